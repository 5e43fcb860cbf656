// Set files: what they become, and how bad ones are refused.
#include "studio/set.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "calibrate/angles.h"
#include "capture/camera.h"

namespace studio::set_test {
namespace {

namespace fs = std::filesystem;

using calibrate::degree;

std::unique_ptr<capture::Camera> open_nothing(std::string_view, const capture::CameraOptions&) {
  throw std::runtime_error("is not to be opened here");
}

// Schemes of the sets here.
const bool made_are_registered = [] {
  for (const char* scheme : {"made", "made_walker"}) capture::register_camera(scheme, open_nothing);
  return true;
}();

// A directory of this test's own, removed at its end.
class SetFile : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    dir_ = fs::path(testing::TempDir()) /
           (std::string("platelight_set_") + info->name() + std::to_string(getpid()));
    fs::create_directories(dir_);
  }
  void TearDown() override { fs::remove_all(dir_); }

  std::string write(const std::string& name, const std::string& content) {
    const fs::path path = dir_ / name;
    std::ofstream(path) << content;
    return path.string();
  }

  fs::path dir_;
};

constexpr const char* plain = R"([show]
width = 64
height = 48
[camera]
source = "made:grey"
)";

TEST_F(SetFile, ReadsTheLeastThatASetNeeds) {
  const Set set = read_set(write("a.toml", plain));
  EXPECT_EQ(set.show.width, 64);
  EXPECT_EQ(set.show.height, 48);
  EXPECT_FALSE(set.show.fps);
  EXPECT_EQ(set.camera.source, "made:grey");
  EXPECT_EQ(set.effort, render::Effort{});
}

TEST_F(SetFile, TellsOnceOfAMeshThatIsNoName) {
  try {
    static_cast<void>(read_set(write("a.toml", std::string(plain) + "[[object]]\nmesh = 5\n")));
    FAIL() << "was accepted";
  } catch (const SetError& error) {
    EXPECT_EQ(std::ranges::count_if(error.diagnostics(),
                                    [](const Diagnostic& d) {
                                      return d.message.find("object.mesh") != std::string::npos;
                                    }),
              1)
        << error.what();
  }
}

TEST_F(SetFile, FindsBesideItAFileWhoseNameHasAColon) {
  const std::string start = "[show]\nwidth = 64\nheight = 48\n[camera]\nsource = ";
  const std::string plate = write("plate 10:30.png", "x");
  EXPECT_EQ(read_set(write("a.toml", start + "\"plate 10:30.png\"\n")).camera.source,
            "file:" + plate);
  for (const char* absent : {"\"plate 10:31.png\"\n", "\"./plate 10:31.png\"\n"}) {
    EXPECT_THROW(static_cast<void>(read_set(write("a.toml", start + absent))), SetError) << absent;
  }
}

TEST_F(SetFile, ReadsEveryKey) {
  write("plate.mp4", "x");
  write("map.exr", "x");
  write("car.glb", "x");
  const Set set = read_set(write("a.toml", R"(name = "all"
[show]
width = 640
height = 480
fps = "30000/1001"
frames = 50
[camera]
source = "file:plate.mp4"
lens = { model = "equisolid", focal_px = 622.4, centre = [1412.5, 932.0], max_angle = 93, size = [2808, 1872] }
pose = { position = [0, -6, 1.6], look_at = [0, 0, 1.6], roll = 0 }
frame = 3
crop = [1000, 1200, 640, 480]
colour = "sRGB"
exposure_s = 0.05
loop = true
deinterlace = false
[probe]
source = "map.exr"
yaw = 90
exposures = "auto"
exposure_error = 0.05
unseen = "mean"
match = { patch = [10, 20, 30, 40], albedo = 0.8 }
vignetting = [0.5]
[[object]]
name = "car"
mesh = "car.glb"
pose = { position = [1, 2, 0], yaw = 30, scale = 3 }
hide = ["Fabric"]
emission_gain = 2
copies = [2, 3]
spacing = [1.5, 2.5]
[[stand_in]]
shape = "box"
size = [1, 2, 3]
catches = ["reflection"]
albedo = [0.1, 0.2, 0.3]
reflectance = 0.05
roughness = 0.1
blocks_light = true
occludes = false
mirrored = true
[[lamp]]
position = [0, 0, 2]
facing = [0, 0, -0.9]
intensity = [1, 2, 3]
[effort]
aa_samples = 4
aa_tolerance = 0.02
glint_contrast = 0.3
light_samples = 16
interleave = 2
adaptive_visibility = false
soft_lights = false
cull_lights = false
accuracy = 0.9
max_depth = 4
max_rays = 900
tile_size = 32
[display]
display = "sRGB"
view = "Un-tone-mapped"
tone = "schlick"
key = 0.2
tone_seconds = 0.5
[record]
file = "take.mkv"
exr = "take"
fill = "fill.mkv"
key = "key.mkv"
codec = "h264"
crf = 23
exr_compression = "piz"
timecode = "10:00:00:00"
)"));
  EXPECT_EQ(set.show.fps, (capture::Rational{30000, 1001}));
  EXPECT_EQ(set.show.frames, 50);
  EXPECT_EQ(set.camera.source, "file:" + (dir_ / "plate.mp4").string());
  EXPECT_EQ(set.camera.lens.width, 640);
  EXPECT_EQ(set.camera.lens.parameters, (std::vector<double>{622.4, 412.5, -268.0}));
  EXPECT_NEAR(set.camera.lens.max_angle_rad, 93 * degree, 1e-12);
  const calibrate::Vec3 p = set.camera.pose.cam_from_set * calibrate::Vec3{0, 0, 1.6};
  EXPECT_NEAR(p.z, 6, 1e-12);
  EXPECT_EQ(set.camera.frame, 3);
  EXPECT_EQ(set.camera.colour, capture::Transfer::srgb);
  EXPECT_TRUE(set.camera.loop);
  EXPECT_EQ(set.camera.deinterlace, false);
  ASSERT_TRUE(set.probe);
  EXPECT_EQ(set.probe->kind, ProbeSettings::Kind::map);
  EXPECT_NEAR(set.probe->yaw_rad, 90 * degree, 1e-12);
  EXPECT_TRUE(set.probe->asks_auto);
  EXPECT_EQ(set.probe->exposure_error, 0.05);
  EXPECT_EQ(set.probe->unseen, render::Unseen::mean);
  EXPECT_EQ(set.probe->match.method, MatchSettings::Method::patch);
  EXPECT_EQ(set.probe->match.patch, (std::array{10, 20, 30, 40}));
  EXPECT_FLOAT_EQ(set.probe->match.albedo[2], 0.8F);
  ASSERT_EQ(set.objects.size(), 1U);
  EXPECT_EQ(set.objects[0].hide, std::vector<std::string>{"Fabric"});
  EXPECT_EQ(set.objects[0].copies, (std::array{2, 3}));
  EXPECT_DOUBLE_EQ(set.objects[0].pose.scale, 3);
  ASSERT_EQ(set.stand_ins.size(), 1U);
  EXPECT_EQ(set.stand_ins[0].shape, StandInSettings::Shape::box);
  EXPECT_FALSE(set.stand_ins[0].catches_shadow);
  EXPECT_TRUE(set.stand_ins[0].catches_reflection);
  EXPECT_TRUE(set.stand_ins[0].blocks_light);
  EXPECT_FALSE(set.stand_ins[0].occludes);
  EXPECT_TRUE(set.stand_ins[0].mirrored);
  ASSERT_EQ(set.lamps.size(), 1U);
  EXPECT_FLOAT_EQ(set.lamps[0].intensity[2], 3);
  EXPECT_EQ(set.lamps[0].facing, (calibrate::Vec3{0, 0, -1}));
  EXPECT_EQ(set.effort.light_samples, 16);
  EXPECT_FLOAT_EQ(set.effort.aa_tolerance, 0.02F);
  EXPECT_FLOAT_EQ(set.effort.glint_contrast, 0.3F);
  EXPECT_FALSE(set.effort.adaptive_visibility);
  EXPECT_FALSE(set.effort.soft_lights);
  EXPECT_EQ(set.display.display, "sRGB");
  ASSERT_TRUE(set.display.tone);
  EXPECT_EQ(set.display.tone->key, 0.2F);
  EXPECT_EQ(set.display.tone->seconds, 0.5);
  EXPECT_EQ(set.record.file, (dir_ / "take.mkv").string());
  EXPECT_EQ(set.record.fill, (dir_ / "fill.mkv").string());
  EXPECT_EQ(set.record.key, (dir_ / "key.mkv").string());
  EXPECT_EQ(set.record.crf, 23);
  EXPECT_EQ(set.record.exr_compression, "piz");
  EXPECT_EQ(set.record.timecode, "10:00:00:00");
}

TEST_F(SetFile, TakesADirectoryOfShotsInOrderOfTheirNames) {
  fs::create_directories(dir_ / "bracket");
  write("bracket/b.jpg", "x");
  write("bracket/a.jpg", "x");
  const Set set = read_set(
      write("a.toml", std::string(plain) + "[probe]\nsource = \"bracket/\"\nlens = \"latlong\"\n"));
  EXPECT_EQ(set.probe->kind, ProbeSettings::Kind::bracket);
  EXPECT_EQ(set.probe->shots,
            (std::vector{(dir_ / "bracket/a.jpg").string(), (dir_ / "bracket/b.jpg").string()}));
  EXPECT_FALSE(set.probe->asks_auto);
  EXPECT_EQ(set.probe->exposure_error, 0.1);
}

TEST_F(SetFile, TakesAMatchAsGainsOrAsAMatrixAndLetsItFollowThePlate) {
  write("map.exr", "x");
  const auto match_of = [&](const std::string& match) {
    return read_set(write("a.toml", std::string(plain) +
                                        "[probe]\nsource = \"map.exr\"\nmatch = " + match + "\n"))
        .probe->match;
  };
  const std::array<float, 3> gain{1, 2, 3};
  const render::ColourMatrix matrix{1, 2, 3, 4, 5, 6, 7, 8, -9};
  EXPECT_EQ(match_of("[1, 2, 3]").method, MatchSettings::Method::given);
  EXPECT_EQ(match_of("[1, 2, 3]").gain, gain);
  EXPECT_FALSE(match_of("[1, 2, 3]").matrix);
  EXPECT_FALSE(match_of("[1, 2, 3]").follow);
  EXPECT_EQ(match_of("[1, 2, 3, 4, 5, 6, 7, 8, -9]").matrix, matrix);
  const MatchSettings follows = match_of("{ gain = [1, 2, 3], follow = true, exposure_s = 0.02 }");
  EXPECT_EQ(follows.method, MatchSettings::Method::given);
  EXPECT_EQ(follows.gain, gain);
  EXPECT_TRUE(follows.follow);
  EXPECT_EQ(follows.exposure_s, 0.02);
  const MatchSettings both = match_of("{ matrix = [1, 2, 3, 4, 5, 6, 7, 8, -9], follow = true }");
  EXPECT_EQ(both.matrix, matrix);
  EXPECT_TRUE(both.follow);
  EXPECT_FALSE(both.exposure_s);
}

TEST_F(SetFile, CountsInstancesOverAllObjects) {
  std::string content = plain;
  content += "model = \"pinhole\"\nfocal_px = 80\n";
  content += "pose = { position = [0, -4, 1], look_at = [0, 0, 0] }\n";
  for (int i = 0; i < 2; ++i) {
    content += "[[object]]\nmade = \"car\"\ncopies = [300, 300]\nspacing = [1, 1]\n";
  }
  EXPECT_THROW(read_set(write("a.toml", content)), SetError);
}

TEST_F(SetFile, RefusesAFileThatIsNotThere) {
  try {
    read_set((dir_ / "absent.toml").string());
    FAIL() << "was accepted";
  } catch (const SetError& error) {
    ASSERT_EQ(error.diagnostics().size(), 1U);
    EXPECT_EQ(error.diagnostics()[0].line, 0);
    EXPECT_THAT(error.what(), testing::HasSubstr("absent.toml: "));
  }
}

TEST_F(SetFile, RefusesADirectory) { EXPECT_THROW(read_set(dir_.string()), SetError); }

TEST_F(SetFile, RefusesNestingWithoutEnd) {
  const std::string deep(100000, '[');
  EXPECT_THROW(read_set(write("a.toml", "name = " + deep)), SetError);
}

// A damaged byte of a good set is either still a set, or refused with a place inside the file.
TEST_F(SetFile, NeverDoesMoreThanRefuseWhateverByteIsDamaged) {
  const std::string good =
      std::string(plain) +
      "model = \"pinhole\"\nfocal_px = 80\npose = { position = [0, -4, 1], look_at = [0, 0, 0] }\n"
      "[[object]]\nmade = \"car\"\npose = { yaw = 30, scale = 1.5 }\n"
      "[[stand_in]]\nsize = [4, 4]\nalbedo = 0.5\n";
  for (std::size_t at = 0; at < good.size(); at += 3) {
    for (const char damage : {'\0', '"', '9', '[', '\n', '\xff'}) {
      std::string bad = good;
      bad[at] = damage;
      try {
        read_set(write("a.toml", bad));
      } catch (const SetError& error) {
        ASSERT_FALSE(error.diagnostics().empty());
        for (const Diagnostic& d : error.diagnostics()) {
          EXPECT_GE(d.line, 1) << to_string(d);
          EXPECT_GE(d.column, 1) << to_string(d);
        }
      }
    }
  }
}

// A file of tests/data/bad/set says in its first lines what must be found in it, and where:
// "# expect LINE:COLUMN words of the message".
struct Expected {
  int line = 0;
  int column = 0;
  std::string words;
};

std::vector<Expected> expectations(const fs::path& path) {
  std::vector<Expected> list;
  std::ifstream file(path);
  std::string hash;
  std::string expect;
  Expected one;
  char colon = 0;
  while (file >> hash >> expect && hash == "#" && expect == "expect" &&
         file >> one.line >> colon >> one.column && std::getline(file >> std::ws, one.words)) {
    list.push_back(one);
  }
  return list;
}

class BadSet : public testing::TestWithParam<fs::path> {};

TEST_P(BadSet, IsRefusedWithEveryFaultInItsPlace) {
  const std::vector<Expected> expected = expectations(GetParam());
  ASSERT_FALSE(expected.empty()) << "the file says nothing of what is wrong with it";
  try {
    read_set(GetParam().string());
    FAIL() << "was accepted";
  } catch (const SetError& error) {
    EXPECT_EQ(error.diagnostics().size(), expected.size()) << error.what();
    for (std::size_t i = 0; i < std::min(expected.size(), error.diagnostics().size()); ++i) {
      const Diagnostic& found = error.diagnostics()[i];
      EXPECT_EQ(found.file, GetParam().string());
      EXPECT_EQ(found.line, expected[i].line) << to_string(found);
      EXPECT_EQ(found.column, expected[i].column) << to_string(found);
      EXPECT_THAT(found.message, testing::HasSubstr(expected[i].words));
    }
  }
}

std::vector<fs::path> bad_sets() {
  std::vector<fs::path> paths;
  for (const auto& entry : fs::directory_iterator(PLATELIGHT_SOURCE_DIR "/tests/data/bad/set")) {
    paths.push_back(entry.path());
  }
  std::ranges::sort(paths);
  return paths;
}

INSTANTIATE_TEST_SUITE_P(Files, BadSet, testing::ValuesIn(bad_sets()), [](const auto& info) {
  return info.param.stem().string();
});

}  // namespace
}  // namespace studio::set_test
