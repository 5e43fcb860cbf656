// The show: its clock, its commands, and that timing changes no bit.
#include "studio/show.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <stdexcept>
#include <thread>

#include "capture/png.h"
#include "render/trace.h"
#include "render/transform.h"
#include "studio/set_scene.h"
#include "studio/tone_follower.h"
#include "tests/made_files.h"
#include "tests/studio/made_show.h"

namespace studio::show_test {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

using ShowTest = MadeShowTest;

using Pictures = std::vector<std::vector<capture::Half>>;

Pictures pictures_of(const Set& set, const ShowOptions& options, std::chrono::milliseconds delay) {
  Pictures pictures;
  Show show(set, options);
  show.run([&](const ShownFrame& shown) {
    pictures.push_back(shown.result->rgba.pixels);
    std::this_thread::sleep_for(delay * (pictures.size() % 3));
  });
  return pictures;
}

TEST_F(ShowTest, GivesTheSameBitsWhateverTheTiming) {
  const Set set = made_set("grey:6,25,0");
  const Pictures fast = pictures_of(set, {}, 0ms);
  ASSERT_EQ(fast.size(), 6U);
  EXPECT_NE(fast[0], fast[1]);
  EXPECT_EQ(pictures_of(set, {}, 7ms), fast);
}

TEST_F(ShowTest, ShowsEveryFrameOfAPlateThatIsSlowerThanTheShowTwice) {
  const Set set = made_set("grey:4,10,0");
  ShowOptions options;
  options.rate = capture::Rational{20, 1};
  const Pictures pictures = pictures_of(set, options, 0ms);
  ASSERT_EQ(pictures.size(), 8U);
  for (std::size_t i = 0; i < 8; i += 2) EXPECT_EQ(pictures[i], pictures[i + 1]) << i;
  EXPECT_NE(pictures[1], pictures[2]);
}

TEST_F(ShowTest, PassesOverFramesOfAPlateThatIsFaster) {
  const Set set = made_set("grey:8,40,0");
  ShowOptions options;
  options.rate = capture::Rational{20, 1};
  std::vector<double> times_s;
  Show show(set, options);
  show.run([&](const ShownFrame& shown) {
    times_s.push_back(std::chrono::duration<double>(shown.prepared.job.textures[0].time).count());
  });
  EXPECT_EQ(times_s, (std::vector<double>{0, 0.05, 0.1, 0.15}));
}

// The cube stands on the real floor: what it sends there moves with it, in the very next frame.
TEST_F(ShowTest, LightsTheSetByWhatItsSurfacesSendOn) {
  const Set set = made_set("grey:6,25,0", "bounce_lamps = 12\n");
  FrameMaker maker(set);
  const auto bounced = [&](std::int64_t frame) {
    std::vector<render::LocalLight> lamps = maker.make(frame).value().job.lights.lamps;
    std::erase_if(lamps, [](const render::LocalLight& lamp) { return lamp.bounced == 0; });
    return lamps;
  };
  const auto before = bounced(0);
  ASSERT_EQ(before.size(), 12U);
  EXPECT_EQ(bounced(1), before);
  maker.move_object("cube", {{3, 0, 0}, 0, 0, 1});
  const auto after = bounced(2);
  ASSERT_EQ(after.size(), 12U);
  for (const render::LocalLight& lamp : after) EXPECT_GT(lamp.position.x, 1.9F);

  const Pictures lit = pictures_of(set, {}, 0ms);
  EXPECT_EQ(pictures_of(set, {}, 7ms), lit);
  EXPECT_NE(lit, pictures_of(made_set("grey:6,25,0"), {}, 0ms));
}

TEST_F(ShowTest, CountsFramesThatThePlateLost) {
  Show show(made_set("grey:9,25,3"));
  show.run();
  EXPECT_EQ(show.status()->frames, 9);
  EXPECT_EQ(show.status()->lost_plate_frames, 3);
  EXPECT_EQ(show.status()->dropped, 0);
}

TEST_F(ShowTest, DropsLateFramesWhenLiveAndKeepsToTheClock) {
  ShowOptions options;
  options.live = true;
  options.frames = 9;
  std::vector<std::int64_t> numbers;
  Show show(made_set("grey:100000,25,0"), options);
  show.run([&](const ShownFrame& shown) {
    numbers.push_back(shown.prepared.job.frame);
    std::this_thread::sleep_for(95ms);
  });
  EXPECT_TRUE(std::ranges::is_sorted(numbers));
  EXPECT_GT(show.status()->dropped, 5);
  EXPECT_EQ(show.status()->frames + show.status()->dropped, numbers.back() + 1);
}

// As by a machine that slept.
TEST_F(ShowTest, GoesOnWhereItWasAfterItWasHeldUpForLong) {
  ShowOptions options;
  options.live = true;
  options.frames = 8;
  options.longest_gap = 400ms;
  std::vector<std::int64_t> numbers;
  Show show(made_set("grey:100000,25,0"), options);
  show.run([&](const ShownFrame& shown) {
    numbers.push_back(shown.prepared.job.frame);
    if (numbers.size() == 4) std::this_thread::sleep_for(1500ms);
  });
  ASSERT_EQ(numbers.size(), 8U);
  // Of what is ready already, and of the 38 frames of that time.
  EXPECT_LT(numbers[5] - numbers[3], 25);
  EXPECT_THAT(show.status()->notes, testing::Contains(testing::HasSubstr("held up for")));
}

TEST_F(ShowTest, EndsWhereItsUserThrowsWhileItIsPaused) {
  ShowOptions options;
  options.frames = 1000;
  Show show(made_set("grey:1,25,0"), options);
  const auto run = [&] {
    show.run([&](const ShownFrame&) {
      show.post(SetPaused{true});
      std::this_thread::sleep_for(50ms);
      throw std::runtime_error("its window is gone");
    });
  };
  EXPECT_THROW(run(), std::runtime_error);
}

// No frame comes that would tell it.
TEST_F(ShowTest, TellsThatItIsPausedAndWhatACommandCannotDoThen) {
  ShowOptions options;
  options.frames = 100'000;
  Show show(made_set("grey:1,25,0"), options);
  bool told = false;
  std::jthread operating([&] {
    const auto wait_until = [&](const auto& is_so) {
      const auto end = std::chrono::steady_clock::now() + 5s;
      while (!is_so(*show.status()) && std::chrono::steady_clock::now() < end) {
        std::this_thread::sleep_for(1ms);
      }
      return is_so(*show.status());
    };
    wait_until([](const ShowStatus& s) { return s.frames > 0; });
    show.post(SetPaused{true});
    told = wait_until([](const ShowStatus& s) { return s.paused; });
    std::this_thread::sleep_for(100ms);  // the last frame is shown by then
    show.post(MoveObject{"nobody", {}});
    told = told && wait_until([](const ShowStatus& s) { return !s.notes.empty(); });
    show.post(Quit{});
  });
  show.run();
  operating.join();
  EXPECT_TRUE(told);
}

// Frames that are rendered later see what they were made with.
TEST_F(ShowTest, ChangesNoLightThatWasHandedOut) {
  FrameMaker maker(made_set("grey:1,25,0"));
  const PreparedFrame first = maker.make(0).value();
  const auto smoothed = first.environment->smoothed.back().pixels;
  const bool apart = first.environment->compact_apart;
  const std::size_t diffused = first.environment->diffused.size();
  render::Effort effort = maker.set().effort;
  effort.light_samples = 256;
  maker.set_effort(effort);
  const PreparedFrame second = maker.make(1).value();
  EXPECT_NE(second.environment, first.environment);
  EXPECT_EQ(first.environment->compact_apart, apart);
  EXPECT_EQ(first.environment->diffused.size(), diffused);
  EXPECT_EQ(first.environment->smoothed.back().pixels, smoothed);
}

TEST_F(ShowTest, TakesThePlatesExposureFromItsSetWhereNoneIsTold) {
  Set set = made_set("grey:2,25,0");
  ASSERT_TRUE(set.probe);
  set.probe->match.follow = true;
  set.probe->match.exposure_s = 0.01;
  set.camera.exposure_s = 0.02;
  Show show(set);
  show.run();
  EXPECT_NEAR(show.status()->match.exposure, 2, 1e-6);
}

TEST_F(ShowTest, HidesPartsOfMadeThings) {
  const auto parts_with = [&](const std::string& hide) {
    const Set set = made_set("grey:1,25,0", "[[object]]\nmade = \"car\"\n" + hide);
    return describe_scene(set).description.instances.size();
  };
  const Set set = made_set("grey:1,25,0", "[[object]]\nname = \"car\"\nmade = \"car\"\n");
  const SetScene whole = describe_scene(set);
  const auto part = std::ranges::find(whole.parts, std::size_t{1}, &ObjectPart::object);
  ASSERT_NE(part, whole.parts.end());
  EXPECT_LT(parts_with("hide = [\"" + part->name + "\"]\n"), whole.description.instances.size());
  try {
    parts_with("hide = [\"no such part\"]\n");
    ADD_FAILURE();
  } catch (const SetError& error) {
    EXPECT_THAT(error.what(), HasSubstr("cannot hide 'no such part': its parts are"));
    EXPECT_THAT(error.what(), HasSubstr(part->name));
  }
}

// Whatever their size and place: of what stands on them, rays leave the lower side above them.
TEST_F(ShowTest, BeginsStandInsBelowWhatStandsOnThem) {
  Set set = made_set("grey:1,25,0");
  ASSERT_FALSE(set.stand_ins.empty());
  set.stand_ins.resize(1);
  StandInSettings& floor = set.stand_ins[0];
  for (const auto shape : {StandInSettings::Shape::plane, StandInSettings::Shape::box}) {
    for (const double size_m : {0.01, 3.0, 20.0}) {
      for (const double scale : {1.0, 0.5}) {
        floor.shape = shape;
        floor.size = {size_m, size_m, 0.1 * size_m};
        floor.pose = {.position = {size_m, -0.5 * size_m, 0}, .scale = scale};
        const double top_m = shape == StandInSettings::Shape::box ? scale * floor.size.z : 0;
        const render::SceneDescription scene = describe_scene(set).description;
        const auto stand_in = std::ranges::find(scene.instances, render::ObjectKind::stand_in,
                                                &render::Instance::kind);
        ASSERT_NE(stand_in, scene.instances.end());
        float highest = -1e9F;
        for (const calibrate::Vec3f p : scene.meshes[stand_in->mesh]->positions) {
          highest = std::max(highest, render::transform_point(stand_in->set_from_object, p).z);
        }
        EXPECT_GT(highest, static_cast<float>(top_m) - 1.01e-3F);
        for (const double along : {-0.49, 0.0, 0.49}) {
          render::HitPoint under;
          under.position = calibrate::to_float(
              {size_m * (1 + scale * along), size_m * (scale * along - 0.5), top_m});
          under.geometric_normal = {0, 0, 1};
          under.largest_coordinate = under.position.x;
          EXPECT_GT(render::offset_origin(under, {0, 0, -1}).z, highest) << size_m << ' ' << along;
        }
      }
    }
  }
}

TEST_F(ShowTest, DelaysPicturesByTwoFramesAtMost) {
  Show show(made_set("grey:40,25,0"));
  show.run([](const ShownFrame&) { std::this_thread::sleep_for(4ms); });
  EXPECT_LE(show.status()->delay_frames, 2.1);
  EXPECT_GT(show.status()->delay_frames, 0);
}

TEST_F(ShowTest, ShowsAStillOnceUnlessToldOtherwise) {
  EXPECT_EQ(pictures_of(made_set("grey:1,25,0"), {}, 0ms).size(), 1U);
  ShowOptions options;
  options.frames = 3;
  EXPECT_EQ(pictures_of(made_set("grey:1,25,0"), options, 0ms).size(), 3U);
}

TEST_F(ShowTest, EndsOnQuit) {
  ShowOptions options;
  options.frames = 1'000'000;
  Show show(made_set("grey:1,25,0"), options);
  show.run([&](const ShownFrame& shown) {
    if (shown.prepared.job.frame == 2) show.post(Quit{});
  });
  EXPECT_LE(show.status()->frames, 5);
  EXPECT_TRUE(show.status()->finished);
}

TEST_F(ShowTest, TakesEffortMovesAndPausesWhileItRuns) {
  ShowOptions options;
  options.frames = 12;
  Show show(made_set("grey:1,25,0"), options);
  Pictures pictures;
  show.run([&](const ShownFrame& shown) {
    pictures.push_back(shown.result->rgba.pixels);
    if (shown.prepared.job.frame == 1) {
      show.post(MoveObject{"cube", {{1.5, 0, 0}, 0, 0.5, 1}});
      render::Effort effort;
      effort.light_samples = 4;
      show.post(SetEffort{effort});
      show.post(SetPaused{true});
      show.post(SetPaused{false});
    }
  });
  EXPECT_EQ(pictures.size(), 12U);
  EXPECT_EQ(pictures[0], pictures[1]);
  EXPECT_NE(pictures[0], pictures[11]);
  EXPECT_EQ(show.status()->effort.light_samples, 4);
  EXPECT_LE(show.status()->lights, 4U);
}

TEST_F(ShowTest, MovesObjectsAndPartsInTheVeryNextFrameWithoutLoadingThemAgain) {
  Set set = made_set("grey:1,25,0");
  FrameMaker maker(set);
  for (const ObjectSettings& object : set.objects) std::filesystem::remove(object.mesh);
  const auto instance = [&] { return maker.make(0)->scene->description().instances[0]; };
  const render::Instance before = instance();
  const std::string part = before.name.substr(before.name.find('/') + 1);
  maker.move_object("cube", {{1.5, 0, 0}, 0, 0, 1});
  EXPECT_EQ(instance().set_from_object[3], 1.5F);
  EXPECT_TRUE(instance().moves);
  maker.move_object("cube/" + part.substr(0, 2), {{0, 0.25, 0}, 0, 0, 1});
  EXPECT_EQ(instance().set_from_object[3], 1.5F);
  EXPECT_EQ(instance().set_from_object[7], before.set_from_object[7] + 0.25F);
  EXPECT_THROW(maker.move_object("cube/spare wheel", {}), std::invalid_argument);
}

// A bulb in its headlight of 800,000 triangles, and the next moment before it.
TEST_F(ShowTest, DragsTheBulbOutOfTheHeadlight) {
  Set set = made_set("grey:1,25,0");
  set.objects.resize(1);
  ObjectSettings& headlight = set.objects[0];
  headlight = {};
  headlight.name = "headlight";
  headlight.made = "headlight";
  set.stand_ins.clear();
  set.camera.pose.cam_from_set = calibrate::look_at({0.7, 0.15, 0.1}, {0, 0, 0}, 0);
  set.effort.aa_samples = 1;
  FrameMaker maker(set);
  const auto picture = [](const PreparedFrame& frame) {
    render::FrameResult result;
    render_frame(frame.inputs(), frame.job, *frame.plate, result);
    return result.rgba.pixels;
  };
  const auto inside = picture(*maker.make(0));
  EXPECT_EQ(picture(*maker.make(1)), inside);
  maker.move_object("headlight/bulb", {{0.25, 0, 0}, 0, 0, 1});
  const auto before = maker.make(2);
  const auto out = picture(*before);
  EXPECT_NE(out, inside);
  maker.move_object("headlight/bulb", {{0.2, 0.1, 0}, 0, 0, 1});
  EXPECT_NE(picture(*maker.make(3)), out);
  // Back in its place it is as if nothing had been: but for what instances round.
  maker.move_object("headlight/bulb", {{0, 0, 0}, 0, 0, 1});
  EXPECT_EQ(triangle_count(maker.make(4)->scene->description()), 800000U);
}

// All that moves is where it would have been: the plate, persons and videos.
TEST_F(ShowTest, BeginsWithAnyFrame) {
  const Set set = made_set("grey:20,25,0",
                           "[[billboard]]\nsource = \"grey:20,50,0\"\nposition = [0, -2, 0]\n"
                           "height = 1\n[[object]]\nname = \"set\"\nmade = \"tv\"\n"
                           "[[video]]\nsource = \"grey:20,12,0\"\nobject = \"set/tv\"\n");
  const auto pictures_of = [&](std::int64_t first, std::int64_t frames) {
    ShowOptions options;
    options.first = first;
    options.frames = frames;
    Show show(set, options);
    Pictures pictures;
    show.run([&](const ShownFrame& shown) { pictures.push_back(shown.result->rgba.pixels); });
    return pictures;
  };
  const Pictures all = pictures_of(0, 8);
  ASSERT_EQ(all.size(), 8U);
  EXPECT_NE(all[6], all[7]);
  EXPECT_EQ(pictures_of(7, 1), Pictures{all[7]});
  EXPECT_EQ(pictures_of(20, 1), Pictures{}) << "it has ended by then";
}

TEST_F(ShowTest, TakesAChangedSetOver) {
  ShowOptions options;
  options.frames = 6;
  const Set set = made_set("grey:1,25,0");
  Show show(set, options);
  Pictures pictures;
  show.run([&](const ShownFrame& shown) {
    pictures.push_back(shown.result->rgba.pixels);
    if (shown.prepared.job.frame == 0) {
      Set changed = set;
      changed.objects.clear();
      show.post(ChangeSet{changed});
    }
  });
  const std::vector<capture::Half>& empty = pictures.back();
  EXPECT_NE(pictures.front(), empty);
  const capture::Half grey = capture::half_from_float(0.1F);
  for (std::size_t i = 0; i < empty.size(); ++i) ASSERT_EQ(empty[i], i % 4 == 3 ? 0 : grey) << i;
}

TEST_F(ShowTest, ShowsAViewBesideAPictureThatStaysAsItIs) {
  const Set set = made_set("grey:1,25,0");
  ShowOptions options;
  options.frames = 8;
  const Pictures plain = pictures_of(set, options, 0ms);
  Show show(set, options);
  std::vector<bool> viewed;
  Pictures pictures;
  std::vector<std::uint8_t> codes;
  show.run([&](const ShownFrame& shown) {
    pictures.push_back(shown.result->rgba.pixels);
    viewed.push_back(shown.view_rgb8 != nullptr);
    EXPECT_EQ(shown.result->rays.pixels.empty(), !viewed.back());
    if (codes.empty()) codes = *shown.rgb8;
    EXPECT_EQ(*shown.rgb8, codes) << "what is recorded";
    if (viewed.back()) {
      EXPECT_EQ(shown.view_rgb8->size(), codes.size());
      EXPECT_NE(*shown.view_rgb8, codes);
    }
    if (shown.prepared.job.frame == 1) show.post(SetView{render::RayView::rays});
    if (shown.prepared.job.frame == 4) show.post(SetView{});
  });
  EXPECT_EQ(pictures, plain);
  EXPECT_FALSE(viewed.front());
  EXPECT_TRUE(viewed[4]);
  EXPECT_FALSE(viewed.back());
  const auto figures = show.status()->pixel_figures;
  ASSERT_TRUE(figures);
  EXPECT_GE((*figures)[static_cast<std::size_t>(render::RayView::rays)].mean, 1);
}

// A plate alone, by which the display's codes are those that came in.
constexpr char only_plate[] =
    "[show]\nwidth = 64\nheight = 48\n[camera]\nsource = \"grey:6,25,0\"\n";

TEST_F(ShowTest, LeavesAPlateToItselfWithoutTone) {
  const std::filesystem::path path = dir_ / "plate.toml";
  std::ofstream(path) << only_plate;
  Show show(read_set(path.string()));
  show.run([](const ShownFrame& shown) {
    EXPECT_EQ(shown.prepared.job.tone, (std::array<float, 2>{1, 0}));
    const float grey = 0.1F + static_cast<float>(shown.prepared.job.frame) / 100;
    const float code = 255 * std::pow(grey, 1 / 2.4F);
    for (const std::uint8_t shown_code : *shown.rgb8) ASSERT_NEAR(shown_code, code, 1);
  });
  EXPECT_EQ(show.status()->frames, 6);
}

TEST_F(ShowTest, TakesATonesCurveFromThePicturesBefore) {
  const Set set = made_set("grey:6,25,0", "[display]\ntone = \"schlick\"\nkey = 0.4\n");
  std::vector<std::array<float, 2>> tones;
  std::vector<std::vector<std::uint8_t>> codes;
  const auto play = [&](std::chrono::milliseconds delay) {
    std::vector<std::array<float, 2>> played;
    ToneFollower follower(*set.display.tone);
    codes.clear();
    Show show(set);
    show.run([&](const ShownFrame& shown) {
      const render::FrameJob& job = shown.prepared.job;
      const auto before = follower.curve();
      follower.follow(compositing::measure_levels(shown.result->rgba), job.time);
      const auto expected = before ? before : follower.curve();
      EXPECT_EQ(job.tone, compositing::parameters_of(*expected)) << job.frame;
      played.push_back(job.tone);
      codes.push_back(*shown.rgb8);
      std::this_thread::sleep_for(delay);
    });
    EXPECT_EQ(show.status()->tone, played.back());
    return played;
  };
  tones = play(0ms);
  const auto first_codes = codes;
  EXPECT_EQ(tones.size(), 6U);
  EXPECT_EQ(tones[0], tones[1]);
  EXPECT_NE(tones[1], tones[5]);
  EXPECT_EQ(play(5ms), tones);
  EXPECT_EQ(codes, first_codes);
  EXPECT_EQ(pictures_of(set, {}, 0ms), pictures_of(made_set("grey:6,25,0"), {}, 0ms))
      << "what is recorded as EXR is linear";
}

TEST_F(ShowTest, RefusesACroppedPlateOfALensForAnotherSize) {
  const std::vector<std::uint8_t> grey(128 * 96 * 3, 120);
  capture::write_png(dir_ / "plate.png", 128, 96, 3, grey);
  const auto set_of = [&](const char* size) {
    const std::string path = write_made_set(dir_, "file:plate.png");
    std::ifstream in(path);
    std::string text{std::istreambuf_iterator<char>(in), {}};
    const std::string lens = "focal_px = 60\n";
    text.replace(text.find(lens), lens.size(),
                 lens + "size = " + size + "\ncrop = [10, 10, 64, 48]\n");
    std::ofstream(path) << text;
    return read_set(path);
  };
  EXPECT_TRUE(FrameMaker(set_of("[128, 96]")).make(0));
  try {
    FrameMaker maker(set_of("[256, 192]"));
    ADD_FAILURE();
  } catch (const SetError& error) {
    EXPECT_THAT(error.what(), HasSubstr("128x96, but its lens is for 256x192"));
  }
}

TEST_F(ShowTest, RefusesAPlateOfAnotherSizeAtItsPlace) {
  Set set = made_set("grey:1,25,0");
  set.show.width = 32;
  try {
    const Show show(set);
    FAIL() << "was accepted";
  } catch (const SetError& error) {
    EXPECT_EQ(error.diagnostics()[0].line, 5);
    EXPECT_THAT(error.what(), HasSubstr("64x48"));
  }
}

TEST_F(ShowTest, RefusesADisplayAndAModelThatThereAreNot) {
  EXPECT_THROW(Show(made_set("grey:1,25,0", "[display]\nview = \"Fancy\"\n")), SetError);
  std::ofstream(dir_ / "damaged.glb") << "glTF";
  EXPECT_THROW(Show(made_set("grey:1,25,0", "[[object]]\nmesh = \"damaged.glb\"\n")), SetError);
}

}  // namespace
}  // namespace studio::show_test
