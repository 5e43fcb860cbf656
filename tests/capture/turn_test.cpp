// Turned pictures: the turns themselves, and videos against the ffmpeg program's own.
#include "capture/turn.h"

#include <gmock/gmock.h>

#include <array>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "capture/camera.h"
#include "tests/independent_plate.h"
#include "tests/made_files.h"

namespace capture::turn_test {
namespace {

using testing::HasSubstr;
using testing::Not;

std::vector<Turn> all_turns() {
  std::vector<Turn> turns;
  for (int i = 0; i < 8; ++i) turns.push_back({(i & 1) != 0, (i & 2) != 0, (i & 4) != 0});
  return turns;
}

// Each pixel tells its place.
Image numbered(int height, int width, int channels) {
  Image image = make_image(height, width, channels);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i);
  return image;
}

TEST(TurnImage, PutsEveryPixelWhereTheMatrixSays) {
  for (const int channels : {3, 4}) {
    const Image image = numbered(19, 37, channels);
    for (const Turn& turn : all_turns()) {
      SCOPED_TRACE(describe(turn));
      // Where a step to the right and a step down lead.
      std::array<std::int32_t, 9> matrix{};
      constexpr std::int32_t one = 1 << 16;
      matrix[turn.transposed ? 3 : 0] = turn.mirrored ? -one : one;
      matrix[turn.transposed ? 1 : 4] = turn.upended ? -one : one;
      EXPECT_EQ(turn_of_matrix(matrix), turn);
      Image turned;
      turn_image(turn, image, turned);
      EXPECT_EQ(turned.width, turn.transposed ? 19 : 37);
      EXPECT_EQ(turned.height, turn.transposed ? 37 : 19);
      ASSERT_EQ(turned.channels, channels);
      for (int y = 0; y < 19; ++y) {
        for (int x = 0; x < 37; ++x) {
          const int to_x = (matrix[0] * x + matrix[3] * y) / one;
          const int to_y = (matrix[1] * x + matrix[4] * y) / one;
          for (int c = 0; c < channels; ++c) {
            ASSERT_EQ(turned.at(turn.upended ? to_y + turned.height - 1 : to_y,
                                turn.mirrored ? to_x + turned.width - 1 : to_x, c),
                      image.at(y, x, c));
          }
        }
      }
    }
  }
}

TEST(CropBefore, BecomesThePartThatIsAskedFor) {
  const Image image = numbered(19, 37, 3);
  for (const Turn& turn : all_turns()) {
    Image whole, turned;
    turn_image(turn, image, whole);
    const Crop part{3, 2, 11, 9};
    const Crop before = crop_before(turn, part, 37, 19);
    Image cut = make_image(before.height, before.width);
    for (int y = 0; y < before.height; ++y) {
      for (int x = 0; x < before.width; ++x) {
        for (int c = 0; c < 3; ++c) cut.at(y, x, c) = image.at(before.y + y, before.x + x, c);
      }
    }
    turn_image(turn, cut, turned);
    ASSERT_EQ(turned.width, part.width);
    ASSERT_EQ(turned.height, part.height);
    for (int y = 0; y < part.height; ++y) {
      for (int x = 0; x < part.width; ++x) {
        ASSERT_EQ(turned.at(y, x, 1), whole.at(part.y + y, part.x + x, 1)) << describe(turn);
      }
    }
  }
}

TEST(TurnOfMatrix, IsNoneForZerosAndNotMadeForOtherAngles) {
  EXPECT_EQ(turn_of_matrix(std::array<std::int32_t, 9>{}), Turn{});
  // Scaled, and not quite even.
  EXPECT_EQ(turn_of_matrix(std::array<std::int32_t, 9>{100, 98304, 0, -65536, 50, 0, 0, 0, 1}),
            (Turn{true, true, false}));
  EXPECT_EQ(turn_of_matrix(std::array<std::int32_t, 9>{46341, 46341, 0, -46341, 46341, 0, 0, 0, 1}),
            std::nullopt);
}

class TurnedVideo : public testing::Test {
 protected:
  std::string make(const std::string& name, const std::string& source, const std::string& options) {
    const std::string clip = (directory_ / name).string();
    independent::ffmpeg(source + " " + options + " '" + clip + "'");
    return clip;
  }
  std::string turned_by(const std::string& angle) {
    const std::string lying = (directory_ / "lying.mp4").string();
    if (!std::filesystem::exists(lying)) make("lying.mp4", card_, x264_);
    return make(angle + ".mp4", "-i '" + lying + "'", "-c copy -metadata:s:v rotate=" + angle);
  }
  // Expects its first frame to be that of the ffmpeg program, which turns pictures itself, of
  // `width` x `height`. Returns its description.
  std::string expect_upright(const std::string& clip, int width, int height) {
    const auto raw = independent::raw_planes(clip, "yuv444p", directory_);
    CameraOptions options;
    options.colour.transfer = Transfer::linear;
    const auto camera = open_camera(clip, options);
    EXPECT_EQ(camera->info().width, width);
    EXPECT_EQ(camera->info().height, height);
    EXPECT_EQ(camera->info().whole_width, width);
    const auto frame = camera->next();
    const Image& image = *frame->image;
    EXPECT_EQ(image.width, width);
    EXPECT_EQ(image.height, height);
    if (image.width != width || image.height != height) return {};
    independent::Planes planes;
    planes.width = width;
    planes.height = height;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        double rgb[3];
        independent::values_at(planes, raw.data(), x, y, rgb);
        for (int c = 0; c < 3; ++c) {
          EXPECT_NEAR(image.at(y, x, c), rgb[c], 1e-6) << x << " " << y;
          if (HasFailure()) return {};
        }
      }
    }
    return camera->info().description;
  }
  std::filesystem::path directory_ = made::make_temporary_directory();
  const std::string card_ =
      "-f lavfi -i \"testsrc2=size=48x32:rate=25:duration=0.2,setsar=2,format=yuv444p\"";
  const std::string x264_ = "-c:v libx264 -preset ultrafast";
};

TEST_F(TurnedVideo, IsUprightAsTheContainerSays) {
  EXPECT_THAT(expect_upright(turned_by("0"), 48, 32), Not(HasSubstr("turned")));
  EXPECT_THAT(expect_upright(turned_by("90"), 32, 48), HasSubstr("counter-clockwise"));
  EXPECT_THAT(expect_upright(turned_by("180"), 48, 32), HasSubstr("turned by 180 degrees"));
  EXPECT_THAT(expect_upright(turned_by("270"), 32, 48),
              HasSubstr("turned by 90 degrees clockwise"));
  EXPECT_EQ(open_camera(turned_by("90"))->info().pixel_aspect.value(), 0.5);
  EXPECT_EQ(open_camera(turned_by("180"))->info().pixel_aspect.value(), 2);
}

TEST_F(TurnedVideo, IsUprightAsItsPicturesSay) {
  const std::string clip = make("lying.h264", card_, x264_);
  const auto marked = [&](const std::string& name, const std::string& words) {
    return make(name + ".h264", "-i '" + clip + "'",
                "-c copy -bsf:v h264_metadata=display_orientation=insert:" + words);
  };
  EXPECT_THAT(expect_upright(marked("a", "rotate=90"), 32, 48), HasSubstr("turned by 90"));
  EXPECT_THAT(expect_upright(marked("b", "flip=horizontal"), 48, 32), HasSubstr("mirrored"));
  EXPECT_THAT(expect_upright(marked("c", "flip=vertical"), 48, 32), HasSubstr("mirrored"));
  EXPECT_THAT(expect_upright(marked("d", "rotate=270:flip=horizontal"), 32, 48),
              HasSubstr("and mirrored"));
}

// The EXIF standard's orientations, 1 to 8.
constexpr std::array<Turn, 8> orientations{{{},
                                            {false, true, false},
                                            {false, true, true},
                                            {false, false, true},
                                            {true, false, false},
                                            {true, true, false},
                                            {true, true, true},
                                            {true, false, true}}};

class TurnedStill : public testing::Test {
 protected:
  void SetUp() override {
    independent::ffmpeg("-f lavfi -i \"testsrc2=size=48x32:rate=1:duration=1,format=yuvj444p\" '" +
                        in("plain.jpg") + "'");
    const std::ifstream file(in("plain.jpg"), std::ios::binary);
    std::stringstream bytes;
    bytes << file.rdbuf();
    plain_ = bytes.str();
  }
  std::string in(const std::string& name) const { return (directory_ / name).string(); }
  // The plain picture with an orientation in its EXIF data.
  std::string marked(const std::string& name, int orientation) const {
    using namespace std::string_literals;
    const std::string exif = "Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0"s +
                             static_cast<char>(orientation) + "\0\0\0\0\0\0"s;
    std::ofstream(in(name), std::ios::binary)
        << plain_.substr(0, 2) << "\xff\xe1\0"s << static_cast<char>(exif.size() + 2) << exif
        << plain_.substr(2);
    return in(name);
  }

  std::filesystem::path directory_ = made::make_temporary_directory();
  std::string plain_;
};

// Lenses are calibrated by pictures of rolled cameras, and probes look up, where cameras do not
// know which way they are held.
TEST_F(TurnedStill, StaysAsTheSensorSawItAndSaysHowItWouldBeUpright) {
  const Image plain = *open_camera(in("plain.jpg"))->next()->image;
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const Turn turn = orientations[static_cast<std::size_t>(orientation - 1)];
    const auto camera = open_camera(marked("a.jpg", orientation));
    EXPECT_EQ(camera->next()->image->pixels, plain.pixels) << orientation;
    const std::string description = camera->info().description;
    EXPECT_EQ(description.find(describe(turn)) != std::string::npos, turn.any()) << description;
  }
  EXPECT_THAT(open_camera(marked("a.jpg", 9))->info().description, Not(HasSubstr("upright")));
}

TEST_F(TurnedVideo, IsTakenAsItIsForOtherAngles) {
  const std::string clip = turned_by("30");
  const auto camera = open_camera(clip);
  EXPECT_EQ(camera->info().width, 48);
  EXPECT_THAT(camera->info().description, HasSubstr("no multiple of 90 degrees"));
}

TEST_F(TurnedVideo, IsCroppedAndLoopsUpright) {
  const std::string clip = turned_by("90");
  const auto whole = open_camera(clip);
  CameraOptions options;
  options.loop = true;
  options.crop = {{20, 30, 12, 15}};
  const auto part = open_camera(clip, options);
  EXPECT_EQ(part->info().whole_width, 32);
  EXPECT_EQ(part->info().height, 15);
  std::vector<std::shared_ptr<const Image>> wholes;
  for (std::size_t n = 0; n < 12; ++n) {
    if (n < 5) wholes.push_back(whole->next()->image);
    const auto frame = part->next();
    ASSERT_TRUE(frame);
    ASSERT_EQ(frame->image->width, 12);
    for (int y = 0; y < 15; ++y) {
      for (int x = 0; x < 12; ++x) {
        ASSERT_EQ(frame->image->at(y, x, 1), wholes[n % 5]->at(y + 30, x + 20, 1));
      }
    }
  }
  options.crop = {{0, 0, 48, 32}};
  EXPECT_THROW(open_camera(clip, options), std::runtime_error) << "that is of the lying picture";
}

}  // namespace
}  // namespace capture::turn_test
