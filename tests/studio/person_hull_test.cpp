// Sets whose persons are filmed by several cameras: what they are shown as, and when cameras fail.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "calibrate/angles.h"
#include "calibrate/track.h"
#include "capture/camera.h"
#include "compositing/made_walker_camera.h"
#include "compositing/person_shape.h"
#include "studio/charts/silhouette.h"
#include "studio/show.h"
#include "tests/studio/made_show.h"

namespace studio::person_hull_test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

using calibrate::degree;
constexpr int video_width = 160, video_height = 200;
constexpr int walking = 16;  // frame of the made walker at which the videos begin

calibrate::Vec3 round_at(double round_deg, double radius_m = 4) {
  return {radius_m * std::sin(round_deg * degree), -radius_m * std::cos(round_deg * degree), 1.4};
}

// A camera at `round_deg` as a set has it. `last` = frame at which it ends, 0 = never.
std::string filmed_from(double round_deg, int first = walking, int last = 0) {
  const calibrate::Vec3 p = round_at(round_deg);
  return fmt::format(
      "source = \"made_walker:round={:g}&width={}&height={}&frames={}\"\ncolour = \"sRGB\"\n"
      "lens = {{ model = \"pinhole\", focal_px = {:g}, size = [{}, {}] }}\n"
      "pose = {{ position = [{}, {}, {}], look_at = [0, 0, 0.9] }}\n"
      "frame = {}\nkey = {{ footage = [0, 7] }}\n",
      round_deg, video_width, video_height, last, 1.5 * video_height, video_width, video_height,
      p.x, p.y, p.z, first);
}

std::string walker_from(const std::vector<std::string>& cameras, const std::string& more = "") {
  std::string text = "[[billboard]]\nname = \"walker\"\nfeet = \"auto\"\n" + more + cameras.front();
  for (std::size_t i = 1; i < cameras.size(); ++i) {
    text += "[[billboard.camera]]\n" + cameras[i];
  }
  return text;
}

// A made walker of which the first frames do not arrive, and so have no picture.
class LateWalker final : public capture::Camera {
 public:
  static constexpr int lost = 3;
  explicit LateWalker(std::unique_ptr<capture::Camera> walker) : walker_(std::move(walker)) {}
  const capture::CameraInfo& info() const override { return walker_->info(); }
  capture::CameraStatistics statistics() const override { return walker_->statistics(); }
  std::optional<capture::Frame> next() override {
    auto frame = walker_->next();
    if (frame && given_++ < lost) {
      frame->image = nullptr;
      frame->status = capture::FrameStatus::lost;
    }
    return frame;
  }

 private:
  std::unique_ptr<capture::Camera> walker_;
  int given_ = 0;
};

class PersonHullTest : public MadeShowTest {
 protected:
  // Seen from `view_deg`, over grey frames of 64x48, or over the empty screen in the size of the
  // videos (8 frames).
  Set walker_set(double view_deg, const std::string& persons, int frames, bool large = false) {
    const calibrate::Vec3 p = round_at(view_deg);
    return written(
        fmt::format("{{ position = [{}, {}, {}], look_at = [0, 0, 0.9] }}", p.x, p.y, p.z), persons,
        frames, large);
  }
  Set written(const std::string& pose, const std::string& persons, int frames, bool large = false) {
    const std::string path = (dir_ / "walker.toml").string();
    const int width = large ? video_width : 64, height = large ? video_height : 48;
    std::ofstream(path) << fmt::format(
        "[show]\nwidth = {}\nheight = {}\nfps = 25\nframes = {}\n"
        "[camera]\nsource = \"{}\"\nmodel = \"pinhole\"\nfocal_px = {:g}\npose = {}\n"
        "colour = \"sRGB\"\n[effort]\naa_samples = 1\n{}",
        width, height, frames,
        large ? fmt::format("made_walker:width={}&height={}", width, height) : "grey:200,25,0",
        1.5 * height, pose, persons);
    return read_set(path);
  }

  struct Told {
    std::vector<PersonStatus> persons;
    std::vector<std::string> notes;
  };
  // Of all frames, or one of so many, of a show in the size of the videos, against photographs of
  // the walker.
  std::vector<PersonError> errors_from(
      double view_deg, const std::string& persons, bool hull, int first = walking, int every = 1) {
    const int frames = compositing::frames_of_nobody / every;
    ShowOptions options;
    options.rate = capture::Rational{25, every};
    Show show(walker_set(view_deg, persons, frames, true), options);
    std::vector<PersonError> errors;
    show.run([&](const ShownFrame& shown) {
      EXPECT_EQ(shown.prepared.persons.at(0).hull, hull);
      const auto truth = compositing::photograph_of(
          compositing::walker_camera_lens(video_width, video_height),
          compositing::walker_camera_pose(view_deg), compositing::filmed_walker(),
          compositing::walk_time_s(first + every * static_cast<int>(errors.size())));
      errors.push_back(person_error(capture::to_float(shown.result->rgba), truth,
                                    capture::to_float(*shown.prepared.plate)));
    });
    return errors;
  }
  static Told run(Set set) {
    Told told;
    Show show(std::move(set));
    show.run([&](const ShownFrame& shown) {
      told.persons.push_back(shown.prepared.persons.at(0));
      for (const std::string& note : shown.prepared.notes) told.notes.push_back(note);
    });
    return told;
  }
};

TEST_F(PersonHullTest, IsShownAsWhatHoldsTheErrorFromThere) {
  const std::string persons = walker_from({filmed_from(0), filmed_from(60)});
  for (const double view : {0.0, 30.0, 60.0}) {
    const Told told = run(walker_set(view, persons, 3));
    ASSERT_EQ(told.persons.size(), 3U);
    for (const PersonStatus& person : told.persons) {
      EXPECT_EQ(person.hull, view == 30) << view;
      if (!person.hull) {
        EXPECT_EQ(person.camera, view == 0 ? 1 : 2);
      }
      EXPECT_TRUE(person.holds) << view << " " << person.error_m;
      EXPECT_LT(person.error_m, 0.05);
      EXPECT_GT(person.confidence, 0.5);
      EXPECT_THAT(person.left_out, IsEmpty());
    }
    EXPECT_THAT(told.notes, IsEmpty()) << view;
  }
}

TEST_F(PersonHullTest, SaysWhereNothingHoldsTheError) {
  const Told told = run(walker_set(100, walker_from({filmed_from(0), filmed_from(60)}), 2));
  EXPECT_FALSE(told.persons.at(0).hull);
  EXPECT_EQ(told.persons[0].camera, 2);
  EXPECT_FALSE(told.persons[0].holds);
  EXPECT_THAT(told.notes, Contains(HasSubstr("nothing holds the error of 0.05 m")));
}

// The second camera is said to look the other way: no place is within both outlines.
TEST_F(PersonHullTest, SaysThatThereIsNoHullWhereOutlinesDoNotMeet) {
  std::string wrong = filmed_from(60);
  const std::string look_at = "look_at = [0, 0, 0.9]";
  wrong.replace(wrong.find(look_at), look_at.size(), "look_at = [2, -8, 0.9]");
  const Told told = run(walker_set(30, walker_from({filmed_from(0), wrong}), 2));
  EXPECT_FALSE(told.persons.at(0).hull);
  EXPECT_FALSE(told.persons[0].holds);
  EXPECT_THAT(told.notes, Contains(HasSubstr("the outlines of its cameras do not meet")));
}

// Frames of nobody: there is no place yet to measure angles from.
TEST_F(PersonHullTest, SaysNothingOfAnglesWhileNobodyStandsThere) {
  const Told told = run(walker_set(100, walker_from({filmed_from(0, 0), filmed_from(60, 0)}), 4));
  EXPECT_FALSE(told.persons.at(0).stands);
  EXPECT_THAT(told.notes, Not(Contains(HasSubstr("degrees"))));
}

// Show frames against photographs of the walker, from between the cameras.
TEST_F(PersonHullTest, IsCloserToTheTruthAsAHullBetweenTheCameras) {
  const std::vector<std::string> cameras{filmed_from(0), filmed_from(60)};
  const auto hull = errors_from(30, walker_from(cameras), true);
  const auto billboard = errors_from(30, walker_from(cameras, "shape = \"billboard\"\n"), false);
  ASSERT_EQ(hull.size(), billboard.size());
  PersonError hulls, billboards;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    EXPECT_LT(hull[i].composite, billboard[i].composite) << i;
    EXPECT_LT(hull[i].silhouette_px, billboard[i].silhouette_px) << i;
    EXPECT_LT(hull[i].wrong_share, billboard[i].wrong_share) << i;
    hulls.composite += hull[i].composite, billboards.composite += billboard[i].composite;
    hulls.silhouette_px += hull[i].silhouette_px;
    billboards.silhouette_px += billboard[i].silhouette_px;
    hulls.wrong_share += hull[i].wrong_share, billboards.wrong_share += billboard[i].wrong_share;
  }
  EXPECT_LT(hulls.composite, 0.8 * billboards.composite);
  EXPECT_LT(hulls.silhouette_px, 0.5 * billboards.silhouette_px);
  EXPECT_LT(hulls.wrong_share, 0.5 * billboards.wrong_share);
}

// Outlines of keyed shows against what is stated.
TEST_F(PersonHullTest, ErrsAsIsStated) {
  constexpr double metres_a_pixel = 4 / (1.5 * video_height);
  const auto measured = [&](double view, bool hull) {
    double sum = 0;
    int frames = 0;
    for (const int first : {walking, walking + 8}) {  // most of a step
      const std::string persons =
          hull ? walker_from({filmed_from(0, first), filmed_from(60, first)}, "shape = \"hull\"\n")
               : walker_from({filmed_from(0, first)});
      for (const PersonError& error : errors_from(view, persons, hull, first, 2)) {
        sum += error.silhouette_px * metres_a_pixel;
        ++frames;
      }
    }
    return sum / frames;
  };
  const std::vector<double> cameras{0, 60 * degree};
  // From the cameras' own places there are only the keys' errors.
  EXPECT_LT(measured(0, true), 0.003);
  EXPECT_LT(measured(0, false), 0.003);
  for (const double view : {15.0, 30.0, 75.0}) {
    const double hull = compositing::hull_error_m(cameras, view * degree);
    const double billboard = compositing::billboard_error_m(view * degree, compositing::off_foot_m);
    EXPECT_NEAR(measured(view, true), hull, 0.25 * hull) << view;
    if (view > 30) continue;  // which the show would say is too far
    EXPECT_NEAR(measured(view, false), billboard, 0.25 * billboard) << view;
  }
}

TEST_F(PersonHullTest, ChangesOnceWhileTheShowsCameraGoesByAndIsTheSameBitsEachTime) {
  constexpr int frames = 25;
  calibrate::Track track;
  for (int i = 0; i <= frames; ++i) {
    const calibrate::Pose pose = calibrate::look_at(round_at(60.0 * i / frames), {0, 0, 0.9}, 0);
    track.keys.push_back(
        {i / 25.0, calibrate::position_of(pose), calibrate::quaternion_of(inverse(pose).R)});
  }
  calibrate::write_track((dir_ / "track.csv").string(), track);
  const Set set =
      written("{ track = \"track.csv\" }", walker_from({filmed_from(0), filmed_from(60)}), frames);
  std::vector<std::vector<capture::Half>> first;
  for (const int slow_ms : {0, 10}) {
    Show show(set);
    std::vector<int> shapes;
    std::vector<std::vector<capture::Half>> pictures;
    show.run([&](const ShownFrame& shown) {
      const PersonStatus& person = shown.prepared.persons.at(0);
      const int shape = person.hull ? 0 : person.camera;
      if (shapes.empty() || shapes.back() != shape) shapes.push_back(shape);
      EXPECT_TRUE(person.holds);
      pictures.push_back(shown.result->rgba.pixels);
      std::this_thread::sleep_for(std::chrono::milliseconds(slow_ms));
    });
    EXPECT_THAT(shapes, ElementsAre(1, 0, 2));
    EXPECT_THAT(show.status()->notes, Contains(HasSubstr("shown as the hull from here")));
    if (first.empty()) first = pictures;
    EXPECT_EQ(pictures, first);
  }
}

TEST_F(PersonHullTest, GoesOnWithoutACameraThatStops) {
  constexpr int frames = 10, stops = 4;
  const std::string ending = filmed_from(60, walking, walking + stops);
  const Told two = run(walker_set(30, walker_from({filmed_from(0), ending}), frames));
  ASSERT_EQ(two.persons.size(), std::size_t{frames});
  for (std::size_t i = 0; i < frames; ++i) {
    EXPECT_EQ(two.persons[i].hull, i < stops + 1) << i;
  }
  EXPECT_THAT(two.persons.back().left_out, ElementsAre(2));
  EXPECT_EQ(two.persons.back().camera, 1);
  EXPECT_FALSE(two.persons.back().holds);
  EXPECT_THAT(two.notes, Contains(HasSubstr("camera 2: left out, for its picture is late")));
  EXPECT_THAT(two.notes, Contains(HasSubstr("shown as the billboard of camera 1")));

  const Told three =
      run(walker_set(30, walker_from({filmed_from(0), ending, filmed_from(80)}), frames));
  EXPECT_TRUE(three.persons.back().hull);
  EXPECT_THAT(three.persons.back().left_out, ElementsAre(2));
  EXPECT_GT(three.persons.back().error_m, three.persons.front().error_m);
}

// Nobody has entered its picture yet.
TEST_F(PersonHullTest, TakesACameraBackOnceItSeesThePerson) {
  const std::string late = filmed_from(60, compositing::frames_of_nobody - 2);
  const Told told = run(walker_set(30, walker_from({filmed_from(0), late}), 22));
  EXPECT_FALSE(told.persons.front().hull);
  EXPECT_THAT(told.persons.front().left_out, ElementsAre(2));
  EXPECT_TRUE(told.persons.back().hull);
  EXPECT_THAT(told.persons.back().left_out, IsEmpty());
  EXPECT_THAT(told.notes, Contains(HasSubstr("camera 2: left out, for it sees nobody")));
  EXPECT_THAT(told.notes, Contains(HasSubstr("camera 2: taken back")));
}

// Of a camera that has given nothing yet the hull would be empty.
TEST_F(PersonHullTest, LeavesACameraOutUntilItsFirstPicture) {
  capture::register_camera(
      "late_walker", [](std::string_view rest, const capture::CameraOptions& options) {
        const std::string uri = "made_walker:" + std::string(rest);
        const bool key = !options.frame;  // the frames that its plate is made from all arrive
        auto walker = capture::open_camera(uri, options);
        return key ? std::move(walker)
                   : std::unique_ptr<capture::Camera>(new LateWalker(std::move(walker)));
      });
  std::string late = filmed_from(60);
  late.replace(late.find("made_walker"), 11, "late_walker");
  const Told told = run(walker_set(30, walker_from({filmed_from(0), late}), 20));
  ASSERT_EQ(told.persons.size(), 20U);
  EXPECT_FALSE(told.persons.front().hull);
  EXPECT_THAT(told.persons.front().left_out, ElementsAre(2));
  EXPECT_THAT(told.notes, Contains(HasSubstr("camera 2: left out")));
  EXPECT_TRUE(told.persons.back().hull);
}

TEST_F(PersonHullTest, IsWhatTheProgramsOwnSetShows) {
  const Set set = read_set(std::string(PLATELIGHT_SOURCE_DIR) + "/studio/sets/walker.toml");
  PersonFeed feed(set, std::nullopt, false);
  for (int i = 0; i < 3; ++i) {
    const auto persons = feed.at(capture::time_of_frame(i, {25, 1}), set.camera.pose.cam_from_set);
    ASSERT_EQ(persons.size(), 1U);
    EXPECT_TRUE(persons[0].status.hull);
    EXPECT_TRUE(persons[0].status.holds);
    EXPECT_THAT(persons[0].hull_cameras, ElementsAre(0, 1));
    EXPECT_EQ(persons[0].pictures.size(), 4U);
    EXPECT_EQ(persons[0].places.size(), 3U);
    // About the walker, and hardly larger.
    const auto& box = persons[0].places[2];
    const calibrate::Vec3 feet = persons[0].status.position;
    EXPECT_LT(box[3], feet.x);
    EXPECT_GT(box[3] + box[0], feet.x);
    EXPECT_LT(box[7], feet.y);
    EXPECT_GT(box[7] + box[5], feet.y);
    EXPECT_NEAR(box[11], 0.001, 1e-4);
    EXPECT_NEAR(box[11] + box[10], 1.73, 0.25);
  }
  EXPECT_THAT(feed.take_notes(), IsEmpty());
}

// Pictures and instances of persons before and after it are their own.
TEST_F(PersonHullTest, IsTheSameAmongOthers) {
  const std::string other =
      "[[billboard]]\nsource = \"grey:50,25,0\"\nheight = 2\nposition = [0, -20, 0]\n";
  const std::string walker = walker_from({filmed_from(0), filmed_from(60)});
  const std::string cut = walker_from({filmed_from(0), filmed_from(60, walking, walking + 2)});
  for (const std::string& persons : {walker, cut}) {
    const auto pictures_of = [&](const std::string& all, std::size_t at) {
      Show show(walker_set(30, all, 6));
      std::vector<std::vector<capture::Half>> pictures;
      show.run([&](const ShownFrame& shown) {
        EXPECT_EQ(shown.prepared.persons.at(at).hull, persons == walker || pictures.size() < 3);
        pictures.push_back(shown.result->rgba.pixels);
      });
      return pictures;
    };
    const auto alone = pictures_of(persons, 0);
    EXPECT_EQ(pictures_of(other + persons, 1), alone);
    EXPECT_EQ(pictures_of(persons + other, 0), alone);
  }
}

TEST_F(PersonHullTest, HoldsTheLastHullWhereAllCamerasEnd) {
  const Told told = run(walker_set(
      30,
      walker_from({filmed_from(0, walking, walking + 3), filmed_from(60, walking, walking + 3)}),
      8));
  EXPECT_TRUE(told.persons.back().hull);
  EXPECT_THAT(told.persons.back().left_out, IsEmpty());
}

TEST_F(PersonHullTest, RefusesWhatDoesNotFitTogetherAllAtOnce) {
  const auto faults_of = [&](const std::string& persons) {
    try {
      run(walker_set(30, persons, 1));
    } catch (const SetError& error) {
      for (const Diagnostic& d : error.diagnostics()) EXPECT_GT(d.line, 0) << d.message;
      return std::string(error.what());
    }
    return std::string("none");
  };
  const std::string first = filmed_from(0), second = filmed_from(60);
  const auto without = [](std::string text, const std::string& key) {
    const std::size_t at = text.find(key + " =");
    return text.erase(at, text.find('\n', at) + 1 - at);
  };
  EXPECT_THAT(
      faults_of("[[billboard]]\nposition = [0, 0, 0]\nheight = 2\nsource = \"grey:9,25,0\"\n"
                "[[billboard.camera]]\n" +
                second),
      HasSubstr("billboard.camera needs lens and pose of the person's first camera"));
  const std::string all =
      faults_of(walker_from({first, without(second, "lens"), without(second, "pose"),
                             without(second, "source"), second + "tilt = 3\n"},
                            "shape = \"ball\"\nerror = -1\n"));
  EXPECT_THAT(all, HasSubstr("billboard.camera.lens is missing"));
  EXPECT_THAT(all, HasSubstr("billboard.camera.pose is missing"));
  EXPECT_THAT(all, HasSubstr("billboard.camera.source is missing"));
  EXPECT_THAT(all, HasSubstr("billboard.camera.tilt"));
  EXPECT_THAT(all, HasSubstr("billboard.shape"));
  EXPECT_THAT(all, HasSubstr("billboard.error"));
  EXPECT_THAT(faults_of(walker_from({first}, "shape = \"hull\"\n")), HasSubstr("further cameras"));
  EXPECT_THAT(faults_of(walker_from({first}, "error = 0.1\n")), HasSubstr("further cameras"));
  EXPECT_THAT(faults_of(walker_from({first, second}, "lit = true\n")),
              HasSubstr("as it was filmed"));
  std::string texel = second;
  texel.replace(texel.find("footage"), 7, "by = \"texel\", footage");
  EXPECT_THAT(faults_of(walker_from({first, texel})), HasSubstr("whole frames"));
  EXPECT_THAT(faults_of(walker_from(std::vector<std::string>(9, first))), HasSubstr("at most 8"));
  // What only opening shows, of both.
  std::string other = second, missing = first;
  other.replace(other.find("size = ["), 8, "size = [1");
  missing.replace(missing.find("made_walker:"), 12, "made_walker:x=1&");
  const std::string opened = faults_of(walker_from({missing, other}));
  EXPECT_THAT(opened, HasSubstr("is no setting"));
  EXPECT_THAT(opened, HasSubstr("but its lens is for"));
}

}  // namespace
}  // namespace studio::person_hull_test
