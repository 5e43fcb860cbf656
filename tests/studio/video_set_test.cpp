// Sets whose objects show live video, and are lit by it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "studio/show.h"
#include "tests/made_files.h"
#include "tests/studio/made_show.h"

namespace studio::video_set_test {
namespace {

using capture::float_from_half;
using testing::Contains;
using testing::HasSubstr;

class VideoSetTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    start();
    register_grey_camera();
  }
  void SetUp() override {
    dir_ = made::make_temporary_directory();
    // A screen of 2 m x 1.5 m that faces the camera.
    std::ofstream(dir_ / "tv.obj") << "mtllib tv.mtl\nv -1 0 3\nv 1 0 3\nv 1 1.5 3\nv -1 1.5 3\n"
                                      "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl screen\n"
                                      "f 1/1 2/2 3/3 4/4\n";
    std::ofstream(dir_ / "tv.mtl") << "newmtl screen\nKd 0 0 0\n";
  }
  void TearDown() override { std::filesystem::remove_all(dir_); }

  Set made_set(const std::string& video, const std::string& plate = "grey:6,25,0") const {
    return read_set(
        write_made_set(dir_, plate, "[[object]]\nname = \"tv\"\nmesh = \"tv.obj\"\n" + video));
  }

  std::filesystem::path dir_;
};

constexpr const char* light = R"([[video_light]]
name = "news"
source = "grey:6,25,0"
object = "tv"
gain = 2
samples = [5, 4]
)";

constexpr const char* lamp = R"([[lamp]]
position = [0, -4, 1]
intensity = [4, 4, 4]
)";

// What the screen mirrors of the sky, at most.
constexpr float glare = 0.05F;

// Of the middle of the screen.
float screen_of(const ShownFrame& shown) {
  const capture::HalfImage& rgba = shown.result->rgba;
  return float_from_half(rgba.pixels[rgba.index(33, 32, 0)]);
}

std::vector<float> screens_of(Show& show, const std::function<void(int)>& before = {}) {
  std::vector<float> screens;
  show.run([&](const ShownFrame& shown) {
    screens.push_back(screen_of(shown));
    if (before) before(static_cast<int>(screens.size()));
  });
  return screens;
}

TEST_F(VideoSetTest, ShowsTheVideosFrameOfItsTimeAndIsLitByIt) {
  Show show(made_set(light));
  int frame = 0;
  show.run([&](const ShownFrame& shown) {
    const float grey = 2 * (0.1F + 0.01F * static_cast<float>(frame));
    EXPECT_NEAR(screen_of(shown), grey, glare) << frame;
    const render::FrameJob& job = shown.prepared.job;
    ASSERT_EQ(job.textures.size(), 3U);
    EXPECT_EQ(job.textures[2].stream, 2U);
    EXPECT_EQ(job.textures[2].time, capture::time_of_frame(frame, {25, 1}));
    ASSERT_EQ(job.lights.lamps.size(), 20U);
    EXPECT_NEAR(job.lights.lamps[7].intensity.x, grey * 3 / 20, 1e-3F);
    EXPECT_NEAR(job.lights.lamps[7].normal.y, -1, 1e-5F) << "towards the camera";
    ++frame;
  });
  EXPECT_EQ(frame, 6);
  EXPECT_TRUE(show.status()->notes.empty());
}

TEST_F(VideoSetTest, GivesTheSameBitsWhateverTheTiming) {
  const Set set = made_set(light);
  Show slow(set), fast(set);
  EXPECT_EQ(screens_of(
                slow, [](int n) { std::this_thread::sleep_for(std::chrono::milliseconds(9 * n)); }),
            screens_of(fast));
}

TEST_F(VideoSetTest, TakesRaysForTheFirstFrameOnly) {
  Show show(made_set(light, "grey:3,25,0"));
  std::vector<std::uint64_t> rays;
  show.run([&](const ShownFrame& shown) {
    rays.push_back(shown.result->statistics.primary_rays + shown.result->statistics.shadow_rays);
  });
  ASSERT_EQ(rays.size(), 3U);
  EXPECT_GT(rays[0], 0U);
  EXPECT_EQ(rays[1] + rays[2], 0U);
}

// A move that is refused changes nothing, and the next one is done.
TEST_F(VideoSetTest, RefusesAMoveThatLeavesNoScreenAndGoesOn) {
  FrameMaker maker(made_set(light));
  const PreparedFrame before = maker.make(0).value();
  const auto places = [](const PreparedFrame& frame) {
    std::vector<std::array<float, 12>> all;
    for (const render::Instance& i : frame.scene->description().instances)
      all.push_back(i.set_from_object);
    return all;
  };
  EXPECT_THROW(maker.move_object("tv", {{200, 300, 0}, 0, 0, 1e-6}), std::exception);
  const PreparedFrame same = maker.make(0).value();
  EXPECT_EQ(places(same), places(before));
  EXPECT_EQ(same.job.lights.lamps.size(), before.job.lights.lamps.size());
  // Nor of a part, as is seen when its object moves.
  int refused = 0;
  for (const render::Instance& i : before.scene->description().instances) {
    if (!i.name.starts_with("tv/")) continue;
    EXPECT_THROW(maker.move_object(i.name, {{200, 300, 0}, 0, 0, 1e-6}), std::exception);
    ++refused;
  }
  EXPECT_GT(refused, 0);
  maker.move_object("tv", maker.set().objects.back().pose);
  EXPECT_EQ(places(maker.make(0).value()), places(before));
  maker.move_object("cube", {{1.5, 0, 0}, 0, 0, 1});
  EXPECT_NE(places(maker.make(0).value()), places(before));
}

TEST_F(VideoSetTest, HoldsTheLastPictureOfAVideoThatEndsAndSaysSo) {
  Show show(made_set("[[video]]\nsource = \"grey:2,25,0\"\nmaterial = \"screen\"\n"));
  const std::vector<float> screens = screens_of(show);
  ASSERT_EQ(screens.size(), 6U);
  EXPECT_NEAR(screens[0], 0.10F, glare);
  for (std::size_t i = 1; i < 6; ++i) EXPECT_NEAR(screens[i], screens[0] + 0.01F, 0.002F);
  EXPECT_THAT(show.status()->notes, Contains(HasSubstr("has ended")));
  EXPECT_EQ(show.status()->notes.size(), 1U);
}

TEST_F(VideoSetTest, ChangesTheSourceByNameWhileItRuns) {
  Show show(made_set(light, "grey:40,25,0"));
  const std::vector<float> screens = screens_of(show, [&](int n) {
    if (n == 8) show.post(SetVideo{"news", "grey:1,25,0"});
    if (n == 10) show.post(SetVideo{"old news", "grey:1,25,0"});
    if (n == 12) show.post(SetVideo{"news", "file:nowhere.mp4"});
  });
  ASSERT_EQ(screens.size(), 40U);
  EXPECT_NEAR(screens[5], screens[0] + 0.1F, 0.005F);
  EXPECT_NEAR(screens[20], screens[0], 0.005F) << "the other source's only picture";
  EXPECT_THAT(show.status()->notes, Contains(HasSubstr("old news")));
  EXPECT_THAT(show.status()->notes, Contains(HasSubstr("nowhere.mp4")));
}

TEST_F(VideoSetTest, RefusesAVideoThatNothingShowsAtItsPlace) {
  for (const char* where : {"object = \"radio\"", "material = \"tin\"", "object = \"cube\""}) {
    const Set set = made_set(std::string("[[video]]\nsource = \"grey:6,25,0\"\n") + where + "\n");
    try {
      FrameMaker maker(set);
      FAIL() << where;
    } catch (const SetError& error) {
      ASSERT_EQ(error.diagnostics().size(), 1U);
      EXPECT_EQ(error.diagnostics()[0].line, set.videos[0].object_place.line);
      EXPECT_THAT(error.what(), HasSubstr("shown nowhere"));
    }
  }
}

// "room/tv" is the screen, not "room/tv set", "room/tv foot" and "room/tv light".
TEST_F(VideoSetTest, IsOnThePartThatIsNamedSo) {
  const std::string tv = "[[object]]\nname = \"room\"\nmade = \"tv\"\n";
  const std::string video =
      "[[video_light]]\nsource = \"grey:6,25,0\"\nsamples = [1, 1]\nobject = ";
  const auto lights_on = [&](const char* object) {
    Set set = made_set(tv + video + object);
    SetScene scene = describe_scene(set);
    return area_lights_of(scene, 0, {1, 1}).size();
  };
  EXPECT_EQ(lights_on("\"room/tv\"\n"), 1U);
  EXPECT_EQ(lights_on("\"room\"\nmaterial = \"screen\"\n"), 1U);
  try {
    lights_on("\"room\"\n");
    ADD_FAILURE() << "a case that is closed";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("faces all ways alike"));
  }
}

// The colour of a matte surface: its light goes with the set's, a lamp's here.
TEST_F(VideoSetTest, IsLitByTheSet) {
  const std::string lit = "[[video]]\nsource = \"grey:6,25,0\"\nobject = \"tv\"\nlit = true\n";
  Show dark(made_set(lit)), bright(made_set(lit + lamp));
  const std::vector<float> none = screens_of(dark), some = screens_of(bright);
  ASSERT_EQ(none.size(), 6U);
  ASSERT_EQ(some.size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) {
    const float grey = 0.1F + 0.01F * static_cast<float>(i);
    EXPECT_NEAR((some[i] - none[i]) / (some[0] - none[0]), grey / 0.1F, 0.02F) << i;
  }
}

TEST_F(VideoSetTest, RefusesALitOneThatGlows) {
  const auto fault_of = [&](const std::string& lines) {
    try {
      made_set(lines);
    } catch (const SetError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string source = "source = \"grey:6,25,0\"\nobject = \"tv\"\nlit = true\n";
  EXPECT_THAT(fault_of("[[video_light]]\n" + source), HasSubstr("gives no light of its own"));
  EXPECT_THAT(fault_of("[[video]]\n" + source + "gain = 2\n"), HasSubstr("gain"));
}

// One that glows and one that is lit have a surface together.
TEST_F(VideoSetTest, ShowsALitVideoBesideOneThatGlows) {
  const std::string both = "[[video]]\nsource = \"grey:6,25,0\"\nobject = \"tv\"\n";
  Show one(made_set(both)), two(made_set(both + both + "lit = true\n" + lamp));
  EXPECT_GT(screens_of(two).at(0), screens_of(one).at(0) + 0.01F);
}

TEST_F(VideoSetTest, RefusesAVideoThatAnotherCovers) {
  const std::string first =
      "[[video]]\nname = \"old\"\nsource = \"grey:6,25,0\"\nobject = \"tv\"\n";
  const Set set = made_set(first + "[[video]]\nsource = \"grey:1,25,0\"\nmaterial = \"screen\"\n");
  try {
    FrameMaker maker(set);
    FAIL();
  } catch (const SetError& error) {
    ASSERT_EQ(error.diagnostics().size(), 1U);
    EXPECT_EQ(error.diagnostics()[0].line, set.videos[0].object_place.line);
    EXPECT_THAT(error.what(), HasSubstr("\"old\" is shown nowhere: those that come after it"));
  }
}

TEST_F(VideoSetTest, RefusesASourceThatCannotBeOpenedAtItsPlace) {
  const Set set = made_set("[[video]]\nsource = \"made.toml\"\nobject = \"tv\"\n");
  try {
    FrameMaker maker(set);
    FAIL();
  } catch (const SetError& error) {
    EXPECT_EQ(error.diagnostics().at(0).line, set.videos[0].source_place.line);
  }
}

TEST_F(VideoSetTest, MovesTheLightWithTheObject) {
  FrameMaker maker(made_set(light));
  const auto before = maker.make(0)->job.lights.lamps.at(3).position;
  PlacementSettings pose;
  pose.position = {1, 0, 0};
  maker.move_object("tv", pose);
  EXPECT_NEAR(maker.make(1)->job.lights.lamps.at(3).position.x, before.x + 1, 1e-5F);
}

}  // namespace
}  // namespace studio::video_set_test
