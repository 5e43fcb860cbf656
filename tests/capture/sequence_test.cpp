// Stills and numbered pictures as cameras, and cameras by URI.
#include "capture/sequence.h"

#include <gmock/gmock.h>

#include <fstream>
#include <stdexcept>

#include "capture/exr.h"
#include "capture/png.h"
#include "capture/rgbe.h"
#include "tests/made_files.h"

namespace capture::sequence_test {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

void write_grey(const std::filesystem::path& path, int code, int width = 4) {
  const std::vector<std::uint8_t> texels(static_cast<std::size_t>(width * 9),
                                         static_cast<std::uint8_t>(code));
  write_png(path, width, 3, 3, texels);
}

float light_of(int code) { return static_cast<float>(decode(Transfer::rec1886, code / 255.0)); }

std::vector<Frame> all_frames(Camera& camera) {
  std::vector<Frame> frames;
  while (std::optional<Frame> frame = camera.next()) frames.push_back(std::move(*frame));
  return frames;
}

TEST(NumberedFiles, AreThoseThatPrintfWouldName) {
  const std::filesystem::path directory = made::make_temporary_directory();
  const std::string pattern = (directory / "flag_%03d.obj").string();
  for (const char* name : {"flag_009.obj", "flag_1000.obj", "flag_0012.obj", "flag_13.obj"}) {
    std::ofstream(directory / name) << "x";
  }
  const auto files = numbered_files(pattern);
  ASSERT_EQ(files.size(), 2U);
  EXPECT_EQ(files.begin()->first, 9);
  for (const auto& [number, file] : files) EXPECT_EQ(numbered_file(pattern, number), file);
  EXPECT_THROW(numbered_files((directory / "flag.obj").string()), std::invalid_argument);
  EXPECT_THROW(numbered_files((directory / "none_%03d.obj").string()), std::runtime_error);
}

TEST(NumberedFiles, TellWhatIsMissingBetweenThem) {
  const std::filesystem::path directory = made::make_temporary_directory();
  const auto missing = [&] {
    return missing_pictures("file:" + (directory / "shot_%d.png").string());
  };
  EXPECT_EQ(missing(), "") << "there are none at all";
  for (const int number : {3, 4, 6, 7, 11})
    write_grey(directory / ("shot_" + std::to_string(number) + ".png"), number);
  EXPECT_EQ(missing(), "5, 8 to 10");
  CameraOptions options;
  options.base_dir = directory.string();
  EXPECT_EQ(missing_pictures("shot_%d.png", options), "5, 8 to 10");
  EXPECT_EQ(missing_pictures((directory / "shot_3.png").string()), "");
  EXPECT_EQ(missing_pictures("v4l2:/dev/video%d"), "");
  EXPECT_EQ(missing_pictures("none:%d"), "");
  for (const int number : {5, 8, 9, 10})
    write_grey(directory / ("shot_" + std::to_string(number) + ".png"), number);
  EXPECT_EQ(missing(), "");
  for (int number = 13; number < 40; number += 2)
    write_grey(directory / ("shot_" + std::to_string(number) + ".png"), 1);
  EXPECT_EQ(missing(), "12, 14, 16, 18, 20, 22, 24, 26 and 6 more gaps");
}

TEST(Sequence, IsInTheOrderOfNumbersWithGapsLost) {
  const std::filesystem::path directory = made::make_temporary_directory();
  for (const int number : {9, 10, 12}) {
    write_grey(directory / ("shot_" + std::to_string(number) + ".png"), number);
  }
  write_grey(directory / "shot_x.png", 99);
  write_grey(directory / "other_11.png", 99);
  CameraOptions options;
  options.picture_rate = {50, 1};
  const auto camera = open_camera("file:" + (directory / "shot_%d.png").string(), options);
  EXPECT_EQ(camera->info().frames, 4);
  EXPECT_EQ(camera->info().rate, (Rational{50, 1}));
  const std::vector<Frame> frames = all_frames(*camera);
  ASSERT_EQ(frames.size(), 4U);
  EXPECT_EQ(frames[0].image->at(1, 1, 1), light_of(9));
  EXPECT_EQ(frames[1].image->at(1, 1, 1), light_of(10));
  EXPECT_EQ(frames[2].status, FrameStatus::lost);
  EXPECT_EQ(frames[2].image, frames[1].image);
  EXPECT_EQ(frames[3].image->at(1, 1, 1), light_of(12));
  EXPECT_EQ(frames[3].time, milliseconds(60));
  EXPECT_EQ(camera->statistics().lost, 1);
}

TEST(Sequence, ReadsNoPictureThatIsPassedOver) {
  const std::filesystem::path directory = made::make_temporary_directory();
  write_grey(directory / "1.png", 1);
  std::ofstream(directory / "2.png") << "no picture";
  write_grey(directory / "3.png", 3);
  const auto camera = open_camera((directory / "%d.png").string());
  ASSERT_TRUE(camera->next());
  EXPECT_TRUE(camera->skip());
  const std::optional<Frame> last = camera->next();
  ASSERT_TRUE(last);
  EXPECT_EQ(last->number, 2);
  EXPECT_EQ(last->image->at(1, 1, 1), light_of(3));
  EXPECT_FALSE(camera->skip());
  EXPECT_EQ(camera->statistics().lost, 0);
}

TEST(Sequence, CountsDigitsAsPrintfDoes) {
  const std::filesystem::path directory = made::make_temporary_directory();
  write_grey(directory / "0007.png", 7);
  write_grey(directory / "8.png", 8);
  write_grey(directory / "00009.png", 9);
  const auto camera = open_camera((directory / "%04d.png").string());
  EXPECT_EQ(camera->info().frames, 1);
}

TEST(Sequence, StartsAtTheFrameThatIsAskedForAndLoops) {
  const std::filesystem::path directory = made::make_temporary_directory();
  for (int number = 0; number < 3; ++number) {
    write_grey(directory / ("a" + std::to_string(number) + ".png"), number * 10);
  }
  CameraOptions options;
  options.frame = 1;
  options.loop = true;
  const auto camera = open_camera((directory / "a%d.png").string(), options);
  const int codes[] = {10, 20, 0, 10, 20, 0};
  for (int i = 0; i < 6; ++i) {
    const std::optional<Frame> frame = camera->next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->number, i + 1);
    EXPECT_EQ(frame->pass_first, (i + 1) / 3 * 3);
    EXPECT_EQ(frame->time, milliseconds(40 * (i + 1)));
    EXPECT_EQ(frame->image->at(0, 0, 0), light_of(codes[i]));
  }
}

TEST(Sequence, LosesDamagedPicturesAndThoseOfAnotherSize) {
  const std::filesystem::path directory = made::make_temporary_directory();
  for (int number = 0; number < 4; ++number) {
    write_grey(directory / ("a" + std::to_string(number) + ".png"), 50, number == 1 ? 5 : 4);
  }
  std::filesystem::resize_file(directory / "a2.png", 60);
  const std::vector<Frame> frames = all_frames(*open_camera((directory / "a%d.png").string()));
  ASSERT_EQ(frames.size(), 4U);
  EXPECT_EQ(frames[0].status, FrameStatus::good);
  EXPECT_EQ(frames[1].status, FrameStatus::lost);
  EXPECT_THAT(frames[1].note, HasSubstr("another size"));
  EXPECT_EQ(frames[2].status, FrameStatus::lost);
  EXPECT_THAT(frames[2].note, HasSubstr("a2.png"));
  EXPECT_EQ(frames[3].status, FrameStatus::good);
}

TEST(Sequence, RefusesWhatIsNotThere) {
  const std::filesystem::path directory = made::make_temporary_directory();
  EXPECT_THAT([&] { open_camera((directory / "a%04d.png").string()); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("no file in")));
  EXPECT_THROW(open_camera("/no/such/folder/a%d.png"), std::runtime_error);
  write_grey(directory / "a1.png", 1);
  write_grey(directory / "a99999999.png", 1);
  EXPECT_THAT([&] { open_camera((directory / "a%d.png").string()); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("are missing before")));
}

TEST(Still, IsOneFrameOrLoops) {
  const std::filesystem::path directory = made::make_temporary_directory();
  const std::string path = (directory / "a%.png").string();
  write_grey(path, 200);
  const auto once = open_camera(path);
  EXPECT_EQ(once->info().rate, (Rational{0, 1}));
  EXPECT_EQ(all_frames(*once).size(), 1U);
  CameraOptions options;
  options.loop = true;
  const auto again = open_camera(path, options);
  const auto first = again->next();
  const auto second = again->next();
  EXPECT_EQ(second->time, milliseconds(40));
  EXPECT_EQ(second->image, first->image) << "read once";
}

TEST(Still, HasOnlyFrameZero) {
  const std::filesystem::path directory = made::make_temporary_directory();
  const std::string path = (directory / "a.png").string();
  write_grey(path, 200);
  CameraOptions options;
  options.frame = 1;
  EXPECT_THAT([&] { open_camera(path, options); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("it has 1 frame")));
}

TEST(Still, MayBeLightAlready) {
  const std::filesystem::path directory = made::make_temporary_directory();
  Image image = make_image(2, 3);
  image.at(1, 2, 0) = 100;
  image.at(1, 2, 1) = 0.25F;
  write_exr((directory / "a.exr").string(), image);
  write_rgbe((directory / "a.hdr").string(), image);
  EXPECT_EQ(open_camera((directory / "a.exr").string())->next()->image->pixels, image.pixels);
  EXPECT_NEAR(open_camera((directory / "a.hdr").string())->next()->image->at(1, 2, 0), 100, 0.5);
  CameraOptions options;
  options.crop = {{2, 1, 1, 1}};
  EXPECT_EQ(open_camera((directory / "a.exr").string(), options)->next()->image->pixels,
            (std::vector<float>{100, 0.25F, 0}));
}

TEST(OpenCamera, FindsRelativePathsFromTheBase) {
  const std::filesystem::path directory = made::make_temporary_directory();
  write_grey(directory / "a.png", 200);
  CameraOptions options;
  options.base_dir = directory.string();
  EXPECT_TRUE(open_camera("file:a.png", options)->next());
  EXPECT_TRUE(open_camera("a.png", options)->next());
}

TEST(OpenCamera, NamesTheSchemesItKnows) {
  EXPECT_THAT([] { open_camera("v4l3:/dev/video0"); },
              testing::ThrowsMessage<std::runtime_error>(
                  testing::AllOf(HasSubstr("v4l3:"), HasSubstr("file:"), HasSubstr("replay:"))));
}

TEST(CheckCameraUri, TellsWhatIsWrongWithoutOpeningAnything) {
  const auto refusal = [](const std::string& uri) -> std::string {
    try {
      check_camera_uri(uri);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  for (const char* good :
       {"v4l2:/dev/none?format=MJPG&size=64x48&rate=30000/1001&gain=3", "v4l2:usb-0000:00:14.0-1",
        "aravis:", "aravis:none?format=Mono12p&Gain=1", "file:/no/such.png", "replay:/no/such",
        "/no/such.png"}) {
    EXPECT_EQ(refusal(good), "") << good;
  }
  EXPECT_THAT(refusal("v4l2:"), HasSubstr("no device is named"));
  EXPECT_THAT(refusal("v4l2:/dev/none?rate=fast"), HasSubstr("rate=fast"));
  EXPECT_THAT(refusal("v4l2:/dev/none?formt=MJPG"), HasSubstr("formt takes a whole number"));
  EXPECT_THAT(refusal("v4l2:/dev/none?format=H264"), HasSubstr("H264 is not read"));
  EXPECT_THAT(refusal("aravis:none?exposre=1"), HasSubstr("no setting exposre"));
  EXPECT_THAT(refusal("aravis:none?format=Mono11"), HasSubstr("Mono11 is not read"));
  EXPECT_THAT(refusal("v4l3:/dev/none"), HasSubstr("no camera is called v4l3:"));
}

TEST(RegisterCamera, AddsAScheme) {
  register_camera("twice", [](std::string_view rest, const CameraOptions& options) {
    return open_camera(std::string("file:") + std::string(rest), options);
  });
  const std::filesystem::path directory = made::make_temporary_directory();
  write_grey(directory / "a.png", 200);
  EXPECT_TRUE(open_camera("twice:" + (directory / "a.png").string())->next());
}

}  // namespace
}  // namespace capture::sequence_test
