// Sets that are edited on air: what the edit does not concern runs on, cameras that can be opened
// only once above all.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <stdexcept>
#include <thread>
#include <utility>

#include "tests/studio/edited_show.h"

namespace studio::set_change_test {
namespace {

using testing::ElementsAre;
using testing::Gt;
using testing::HasSubstr;
using testing::IsEmpty;

using SetChangeTest = EditedShowTest;

// The number of the frame that the set's only person shows.
int shown_number(const PreparedFrame& frame) {
  const float grey = frame.scene->pictures().at(0)->look_up(0.5F, 0.5F, 0)[0];
  return static_cast<int>(std::lround((grey - 0.1F) * 100));
}

// Shows a frame of the first set, then one of each edit; the numbers that its person shows.
std::vector<int> numbers_over(FrameMaker& maker, const std::vector<Set>& edits) {
  std::vector<int> numbers{shown_number(maker.make(0).value())};
  for (const Set& edit : edits) {
    maker.change_set(edit);
    numbers.push_back(shown_number(maker.make(static_cast<std::int64_t>(numbers.size())).value()));
  }
  return numbers;
}

TEST_F(SetChangeTest, PersonsRunOnWhateverElseIsEdited) {
  FrameMaker maker(person_set("sole:0"));
  const std::vector<Set> edits{
      person_set("sole:0", "height = 2\nposition = [0, 0, 0]\nname = \"she\"\n", "# a line more\n"),
      person_set("sole:0", "height = 1.8\nposition = [1, 2, 0]\nyaw = 20\n"),
      person_set("sole:0", "height = 2\nposition = [0, 0, 0]\n",
                 "[[stand_in]]\nname = \"more\"\nsize = [2, 2]\n"),
  };
  EXPECT_THAT(numbers_over(maker, edits), ElementsAre(0, 1, 2, 3));
  EXPECT_EQ(opened, 1);
}

TEST_F(SetChangeTest, AnotherFirstFrameOpensAPersonsFileAnew) {
  FrameMaker maker(person_set("grey:100,25,0"));
  const Set later = person_set("grey:100,25,0", "height = 2\nposition = [0, 0, 0]\nloop = true\n");
  EXPECT_THAT(numbers_over(maker, {later, later}), ElementsAre(0, 0, 1));
}

TEST_F(SetChangeTest, AnEndedVideoKeepsItsLastPicture) {
  capture::Image plate = capture::make_image(32, 64);
  for (std::size_t i = 0; i < plate.pixels.size(); i += 3) plate.pixels[i + 1] = 0.5F;
  capture::write_exr((dir_ / "plate.exr").string(), plate);
  std::vector<Set> edits;
  for (const char* key : {"", "key = { plate = \"plate.exr\" }\n"}) {
    edits.push_back(person_set("sole:3", std::string("height = 2\nposition = [0, 0, 0]\n") + key));
  }
  FrameMaker maker(edits.front());
  for (std::int64_t n = 0; n < 10; ++n) ASSERT_TRUE(maker.make(n));
  maker.change_set(edits.front());
  EXPECT_EQ(shown_number(maker.make(10).value()), 2);
  maker.change_set(edits.back());  // keyed now: nothing of it is green
  EXPECT_EQ(shown_number(maker.make(11).value()), 2);
  maker.change_set(edits.front());
  EXPECT_EQ(shown_number(maker.make(12).value()), 2);
  EXPECT_EQ(opened, 1);
}

// As an operator does who sees that the camera was bumped.
TEST_F(SetChangeTest, APlateThatWasTakenAnewIsReadAnew) {
  const std::string plate = (dir_ / "plate.exr").string();
  const auto write = [&](int width) {
    capture::Image green = capture::make_image(32, width);
    for (std::size_t i = 0; i < green.pixels.size(); i += 3) green.pixels[i + 1] = 0.5F;
    capture::write_exr(plate, green);
  };
  write(64);
  const std::string keyed = "height = 2\nposition = [0, 0, 0]\nkey = { plate = \"plate.exr\" }\n";
  FrameMaker maker(person_set("sole:0", keyed));
  ASSERT_TRUE(maker.make(0));
  const auto written = std::filesystem::last_write_time(plate);
  write(62);
  std::filesystem::last_write_time(plate, written + std::chrono::seconds(1));
  EXPECT_THROW(maker.change_set(person_set("sole:0", keyed)), SetError);
  EXPECT_EQ(shown_number(maker.make(1).value()), 1) << "the show goes on as it was";
  write(64);
  maker.change_set(person_set("sole:0", keyed));
  EXPECT_EQ(shown_number(maker.make(2).value()), 2);
  EXPECT_EQ(opened, 1);
}

// The plate is decoded by the one that was there when it was opened.
TEST_F(SetChangeTest, AResponseThatWasMeasuredAnewIsRefused) {
  const std::string response = (dir_ / "plate.rsp").string();
  std::ofstream(response) << "1 1 0\n1 1 0\n1 1 0\n";
  Set set = made_set("grey:9,25,0", "");
  set.camera.response = response;
  FrameMaker maker(set);
  ASSERT_TRUE(maker.make(0));
  maker.change_set(set);
  std::filesystem::last_write_time(
      response, std::filesystem::last_write_time(response) + std::chrono::seconds(1));
  try {
    maker.change_set(set);
    ADD_FAILURE() << "taken over";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("plate.rsp was written anew"));
  }
  EXPECT_TRUE(maker.make(1));
}

// Its feet are followed on while the dials of its key are turned.
TEST_F(SetChangeTest, AWalkerStandsWhereItWouldHaveStood) {
  const auto walker = [&](const std::string& key) {
    return person_set("made_walker:width=160&height=200",
                      "lens = { model = \"pinhole\", focal_px = 300, size = [160, 200] }\n"
                      "pose = { position = [0, -4, 1.4], look_at = [0, 0, 0.9] }\n"
                      "feet = \"auto\"\nframe = 16\nkey = { footage = [0, 7]" +
                          key + " }\n");
  };
  FrameMaker alone(walker("")), edited(walker(""));
  std::vector<std::string> notes;
  for (std::int64_t n = 0; n < 8; ++n) {
    if (n == 3) edited.change_set(walker(", despill = 0.5"));
    if (n == 5) edited.change_set(walker(", despill = 0.5"));
    const PreparedFrame one = alone.make(n).value(), other = edited.make(n).value();
    notes.insert(notes.end(), other.notes.begin(), other.notes.end());
    const PersonStatus &a = one.persons.at(0), &b = other.persons.at(0);
    EXPECT_EQ(a.feet, b.feet) << n;
    EXPECT_LT(calibrate::length(a.position - b.position), 0.003) << n;  // alpha is smoothed anew
  }
  EXPECT_THAT(notes, IsEmpty());
}

// Two persons of one video have one each, before and after.
TEST_F(SetChangeTest, EveryPersonGoesOnWithAVideoOfItsOwn) {
  const std::string two =
      "height = 2\nposition = [0, 0, 0]\n[[billboard]]\nsource = \"grey:9,25,0\"\n"
      "colour = \"linear\"\nheight = 1\nposition = [1, 0, 0]\n";
  FrameMaker maker(person_set("grey:9,25,0", two));
  for (std::int64_t n = 0; n < 4; ++n) {
    if (n == 1) maker.change_set(person_set("grey:9,25,0", two + "name = \"second\"\n"));
    if (n == 2) maker.change_set(person_set("grey:9,25,0"));
    if (n == 3) maker.change_set(person_set("grey:9,25,0", two));
    EXPECT_EQ(shown_number(maker.make(n).value()), n);
  }
}

TEST_F(SetChangeTest, TheProbesCameraRunsOn) {
  const std::string given = "match = [1, 1, 1]\nlens = \"latlong\"\n";
  FrameMaker maker(probe_set("sole:0", given));
  const auto frames_at = [&](std::int64_t n) { return maker.make(n).value().probe.frames; };
  frames_at(0);
  const std::int64_t first = frames_at(20);
  maker.change_set(
      probe_set("sole:0", given, "# an edit\n[[stand_in]]\nname = \"more\"\nsize = [2, 2]\n"));
  EXPECT_GT(frames_at(21), first);
  // The light itself is another one now.
  maker.change_set(probe_set("sole:0", "match = [2, 2, 2]\nyaw = 30\nlens = \"latlong\"\n"));
  const PreparedFrame after = maker.make(22).value();
  EXPECT_GT(after.probe.frames, first + 1);
  EXPECT_EQ(after.match.gain[0], 2);
  EXPECT_EQ(opened, 1);
  // Of another one it is said why it cannot be had.
  try {
    maker.change_set(probe_set("sole:0", given + "colour = \"sRGB\"\n"));
    ADD_FAILURE() << "two of it are open";
  } catch (const SetError& error) {
    EXPECT_THAT(error.what(), HasSubstr("busy"));
  }
  EXPECT_GT(maker.make(23).value().probe.frames, after.probe.frames);
}

// While the camera of an edit is still being opened, whatever comes meanwhile.
TEST_F(SetChangeTest, NoFrameOrCommandWaitsForAnEditAndTheNewestIsNext) {
  FrameMaker maker(made_set("grey:1,25,0"));
  std::int64_t n = 0;
  const auto cube_x = [&] {
    return maker.make(n++).value().scene->description().instances[0].set_from_object[3];
  };
  const auto effort_of = [](Set set, int aa_samples) {
    set.effort.aa_samples = aa_samples;
    return set.effort;
  };
  const Set first = person_set("held:0");
  const Set passed_over = person_set("made.toml");
  const Set last = person_set("held:0", placed, "[[object]]\nname = \"more\"\nmade = \"desk\"\n");
  ASSERT_EQ(cube_x(), 0);
  opening.shut();
  maker.change_set_beside(first);
  maker.change_set_beside(passed_over);
  maker.set_effort(effort_of(first, 7));
  maker.move_object("cube", {{1, 0, 0}, 0, 0, 1});
  EXPECT_EQ(cube_x(), 1) << "at once";
  EXPECT_EQ(maker.make(n++).value().job.effort.aa_samples, 7);
  maker.change_set_beside(last);
  maker.move_object("cube", {{3, 0, 0}, 0, 0, 1});
  maker.move_object("cube", {{2, 0, 0}, 0, 0, 1});
  maker.move_object("more", {{0, 5, 0}, 0, 0, 1});  // which only that one has
  maker.move_object("nobody", {});
  EXPECT_EQ(cube_x(), 2);
  EXPECT_FALSE(opening.overdue());
  opening.open();
  auto notes = make_until(maker, n, [](const auto& frame) { return !frame.persons.empty(); });
  EXPECT_THAT(notes, IsEmpty()) << "the last edit may make it possible";
  EXPECT_EQ(maker.set().effort.aa_samples, 7) << "it came after the first edit";
  EXPECT_EQ(maker.set().objects[0].pose.position.x, 2);
  notes = make_until(maker, n, [&](const auto&) { return maker.set().objects.size() == 2; });
  EXPECT_THAT(notes, ElementsAre(HasSubstr("nobody")));
  EXPECT_EQ(maker.set().effort.aa_samples, 4) << "the last edit came after it";
  for (const ObjectSettings& object : maker.set().objects) {
    const calibrate::Vec3& at = object.pose.position;
    EXPECT_EQ(object.name == "cube" ? at.x : at.y, object.name == "cube" ? 2 : 5);
  }
  EXPECT_FALSE(maker.is_changing());
  EXPECT_EQ(opened, 1);
}

// A device gives one colour at a time.
TEST_F(SetChangeTest, SaysWhoHoldsADeviceThatIsAskedForInAnotherColour) {
  const auto refusal = [](FrameMaker& maker, const Set& edit) -> std::string {
    try {
      maker.change_set(edit);
    } catch (const SetError& error) {
      return error.what();
    }
    return "";
  };
  const std::string tv = "[[object]]\nname = \"set\"\nmade = \"tv\"\n";
  const Set videos = made_set("grey:1,25,0", tv + "[[video]]\nname = \"news\"\nsource = "
                                                  "\"live_sole:0\"\nobject = \"set/tv\"\n");
  const Set persons = person_set("live_sole:0", placed + "name = \"she\"\n");
  const Set without = made_set("grey:1,25,0");
  for (const Set& set : {videos, persons}) {
    FrameMaker maker(set);
    ASSERT_TRUE(maker.make(0));
    Set edit = set;
    for (VideoSettings& video : edit.videos) video.colour = capture::Transfer::srgb;
    for (PersonSettings& she : edit.persons) she.cameras[0].colour = capture::Transfer::srgb;
    EXPECT_THAT(
        refusal(maker, edit),
        testing::AllOf(HasSubstr("busy"), HasSubstr("colour"), HasSubstr("two edits"),
                       HasSubstr(set.videos.empty() ? "she holds it" : "video \"news\" holds it")));
    ASSERT_TRUE(maker.make(1));
    EXPECT_EQ(refusal(maker, without), "");  // as it says
    EXPECT_EQ(refusal(maker, edit), "");
    ASSERT_TRUE(maker.make(2));
  }
}

// A device that stalls: it is closed beside the frames, and opened again once it is.
TEST_F(SetChangeTest, NoFrameWaitsForWhatGoesAndWhatComesBackDoes) {
  const std::string tv = "[[object]]\nname = \"set\"\nmade = \"tv\"\n";
  const std::string video = "[[video]]\nsource = \"held:0\"\nobject = \"set/tv\"\n";
  const std::string light = "match = [1, 1, 1]\nlens = \"latlong\"\n";
  for (const auto& [with, without] :
       {std::pair(person_set("held:0"), made_set("grey:1,25,0")),
        std::pair(made_set("grey:1,25,0", tv + video), made_set("grey:1,25,0", tv)),
        std::pair(probe_set("held:0", light), probe_set("recorded:900", light))}) {
    opened = 0;
    FrameMaker maker(with);
    std::int64_t n = 0;
    ASSERT_TRUE(maker.make(n++));
    closing.shut();
    maker.change_set_beside(without);
    make_until(maker, n, [&](const auto&) { return !maker.is_changing(); });
    EXPECT_EQ(open_now, 1) << "it is being closed";
    maker.change_set_beside(with);
    for (int i = 0; i < 3; ++i) EXPECT_TRUE(maker.make(n++));
    EXPECT_TRUE(maker.is_changing()) << "it waits for that";
    EXPECT_FALSE(closing.overdue());
    closing.open();
    const auto notes = make_until(maker, n, [&](const auto&) { return !maker.is_changing(); });
    EXPECT_THAT(notes, testing::Each(testing::Not(HasSubstr("busy"))));
    EXPECT_EQ(opened, 2);
    EXPECT_EQ(open_now, 1);
  }
  EXPECT_EQ(open_now, 0) << "the end waits for all";
}

TEST_F(SetChangeTest, WhatComesBackMayBeGoneJustWhenItIsFoundBusy) {
  const Set with = person_set("tardy:0"), without = made_set("grey:1,25,0");
  FrameMaker maker(with);
  std::int64_t n = 0;
  ASSERT_TRUE(maker.make(n++));
  closing.shut();
  maker.change_set(without);
  maker.change_set_beside(with);
  const auto notes = make_until(maker, n, [&](const auto&) { return !maker.is_changing(); });
  EXPECT_THAT(notes, IsEmpty());
  EXPECT_EQ(opened, 2);
}

// No frame comes that would take it over and tell it.
TEST_F(SetChangeTest, AnEditThatIsReadyInAPauseIsTakenOverAndToldThen) {
  ShowOptions options;
  options.live = true;
  options.frames = 100'000;
  Show show(made_set("grey:1,25,0"), options);
  bool taken = false, told = false;
  opening.shut();
  std::jthread operating([&, edit = person_set("late:9"), wrong = person_set("made.toml")] {
    const auto wait_until = [&](const auto& is_so) {
      const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(5);
      while (!is_so(*show.status()) && std::chrono::steady_clock::now() < end) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
      return is_so(*show.status());
    };
    wait_until([](const ShowStatus& s) { return s.frames > 0; });
    show.post(SetPaused{true});
    wait_until([](const ShowStatus& s) { return s.paused; });
    show.post(ChangeSet{edit});
    taken = wait_until([](const ShowStatus& s) { return s.changing; });
    opening.open();
    taken = taken && wait_until([](const ShowStatus& s) { return !s.changing; });
    show.post(ChangeSet{wrong});
    told = wait_until([](const ShowStatus& s) { return !s.notes.empty(); });
    show.post(Quit{});
  });
  show.run();
  operating.join();
  EXPECT_TRUE(taken);
  EXPECT_TRUE(told);
}

// However long the show has run.
TEST_F(SetChangeTest, ARecordedProbeThatIsOpenedAnewStaysInStepWithThePlate) {
  const std::string given = "match = [1, 1, 1]\nlens = \"latlong\"\n";
  for (const bool loop : {false, true}) {
    const auto set = [&](const std::string& probe) {
      Set made = probe_set(loop ? "recorded:300" : "recorded:900", given + probe);
      made.camera.loop = loop;
      return made;
    };
    FrameMaker maker(set("")), edited(set(""));
    const auto shown = [](FrameMaker& one, std::int64_t n) {
      const PreparedFrame frame = one.make(n).value();
      return std::lround(frame.environment->radiance.pixels.front() * 1000);
    };
    EXPECT_EQ(shown(maker, 700), loop ? 101 : 701);
    EXPECT_EQ(shown(edited, 700), loop ? 101 : 701);
    recorded_frames_read = 0;
    edited.change_set(set("colour = \"sRGB\"\n"));
    EXPECT_LT(recorded_frames_read, 100);
    for (const std::int64_t n : {701, 702, 750, 899, 903}) {
      EXPECT_EQ(shown(edited, n), shown(maker, n)) << n;
    }
    // Beside the frames it is the same.
    std::int64_t n = 904;
    edited.change_set_beside(set(""));
    make_until(edited, n, [&](const auto&) { return !edited.is_changing(); });
    EXPECT_EQ(shown(edited, n), shown(maker, n));
  }
}

TEST_F(SetChangeTest, TheFirstLightIsMadeBesideTheFrames) {
  const Set set = made_set("grey:1,25,0");
  const capture::Image plate = capture::make_image(48, 64);
  LightFeed light(set);
  LightRequest request;
  request.plate = &plate;
  const auto begun = light.begin(request);
  ASSERT_NE(begun, nullptr);
  EXPECT_EQ(light.at(request).environment, begun);
}

// Who would never be seen.
TEST_F(SetChangeTest, APersonByItsFeetNeedsAMatte) {
  try {
    FrameMaker maker(person_set("sole:0",
                                "lens = { model = \"pinhole\", focal_px = 60, size = [64, 32] }\n"
                                "pose = { position = [0, -4, 1.4], look_at = [0, 0, 0.9] }\n"
                                "feet = \"auto\"\n"));
    ADD_FAILURE();
  } catch (const SetError& error) {
    EXPECT_THAT(error.what(), HasSubstr("needs a key"));
  }
}

// Of shows, beside whose frames the edit is made.
TEST_F(SetChangeTest, LiveCamerasAreOpenedOnceInAShowThatIsEditedAgainAndAgain) {
  const auto set = [&](int edit, const std::string& probe = "") {
    return probe_set("live_sole:0", "match = [1, 1, 1]\nlens = \"latlong\"\n" + probe,
                     fmt::format("[[billboard]]\nsource = \"grey:1000,25,0\"\ncolour = \"linear\"\n"
                                 "position = [0, 0, 0]\nheight = {}\n",
                                 2 + edit));
  };
  std::vector<Set> edits;
  for (int n = 4; n < 30; n += 5) edits.push_back(set(n));
  edits.push_back(set(0, "colour = \"sRGB\"\n"));
  ShowOptions options;
  options.live = true;
  options.frames = 500;  // of which so many are shown as it takes to refuse the last edit
  Show show(set(0), options);
  int n = 0, furthest = 0;
  show.run([&](const ShownFrame& shown) {
    furthest = std::max(furthest, shown_number(shown.prepared));
    if (n % 5 == 4 && n < 35) show.post(ChangeSet{edits[static_cast<std::size_t>(n / 5)]});
    if (++n > 40 && !show.status()->notes.empty()) show.post(Quit{});
  });
  EXPECT_GT(furthest, 30) << "the person's video goes on";
  EXPECT_EQ(opened, 1);
  EXPECT_THAT(show.status()->notes, ElementsAre(HasSubstr("It is on air")));
}

}  // namespace
}  // namespace studio::set_change_test
