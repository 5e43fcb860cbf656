// Scripts: each command in its very frame, whatever the timing, and every fault before the show.
#include "studio/script.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "capture/png.h"
#include "studio/show.h"
#include "tests/studio/command_line.h"
#include "tests/studio/made_show.h"

namespace studio::script_test {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using Picture = std::vector<capture::Half>;

// What a frame came to.
struct Taken {
  std::int64_t frame = 0;
  Picture picture;
  float x = 0;  // of the first object's first part
  render::RenderStatistics statistics;
  int aa_samples = 0;
  bool view = false;
};

const std::string tv =
    "[[object]]\nname = \"set\"\nmade = \"tv\"\n"
    "[[video]]\nname = \"news\"\nsource = \"grey:1,25,0\"\nobject = \"set/tv\"\n";

class ScriptTest : public MadeShowTest {
 protected:
  std::string write(const std::string& name, const std::string& content) const {
    std::ofstream(dir_ / name) << content;
    return (dir_ / name).string();
  }
  Script script(const Set& set, const std::string& text) const {
    return read_script(write("script.toml", text), set);
  }
  // Every third frame is held up by `delay`.
  std::vector<Taken> take(const Set& set,
                          const std::string& text = "",
                          ShowOptions options = {},
                          std::chrono::milliseconds delay = 0ms) {
    if (!text.empty()) options.script = script(set, text);
    std::vector<Taken> taken;
    Show show(set, options);
    show.run([&](const ShownFrame& shown) {
      taken.push_back({shown.prepared.job.frame, shown.result->rgba.pixels,
                       shown.prepared.scene->description().instances[0].set_from_object[3],
                       shown.result->statistics, shown.prepared.job.effort.aa_samples,
                       shown.view_rgb8 != nullptr});
      std::this_thread::sleep_for(delay * (taken.size() % 3));
    });
    notes_ = show.status()->notes;
    return taken;
  }
  // What reading, and opening, a script for the set finds, without the file's own path.
  std::string faults_of(const Set& set, const std::string& text) const {
    const std::string path = (dir_ / "script.toml").string();
    std::string faults;
    try {
      ShowOptions options;
      options.script = script(set, text);
      Show show(set, options);
    } catch (const SetError& error) {
      faults = error.what();
    }
    for (std::size_t at; (at = faults.find(path + ":")) != faults.npos;) {
      faults.erase(at, path.size() + 1);
    }
    return faults;
  }

  std::vector<std::string> notes_;
};

std::vector<Picture> pictures_of(const std::vector<Taken>& taken) {
  std::vector<Picture> pictures;
  for (const Taken& frame : taken) pictures.push_back(frame.picture);
  return pictures;
}

std::vector<Picture> part_of(const std::vector<Taken>& taken, std::size_t first, std::size_t end) {
  const std::vector<Picture> all = pictures_of(taken);
  return {all.begin() + static_cast<std::ptrdiff_t>(first),
          all.begin() + static_cast<std::ptrdiff_t>(end)};
}

TEST_F(ScriptTest, MovesAnObjectInTheVeryFrameAsIfItHadBeenThereFromTheStart) {
  const std::string text =
      "[[at]]\nframe = 4\nmove = \"cube\"\npose = { position = [1.5, 0, 0], yaw = 30 }\n";
  const Set set = made_set("grey:8,25,0");
  Set there = set;
  there.objects[0].pose = {{1.5, 0, 0}, 0, 30 * 3.14159265358979323846 / 180, 1};
  const std::vector<Taken> taken = take(set, text);
  ASSERT_EQ(taken.size(), 8U);
  EXPECT_EQ(part_of(taken, 0, 4), part_of(take(set), 0, 4));
  EXPECT_EQ(part_of(taken, 4, 8), part_of(take(there), 4, 8));
  EXPECT_NE(taken[4].picture, take(set)[4].picture);
  EXPECT_EQ(pictures_of(take(set, text, {}, 9ms)), pictures_of(taken));
}

// So that its rate holds: nothing but the pebble changes, which the cube does not see.
TEST_F(ScriptTest, FindsOnlyAnewWhatAMoveConcerns) {
  Set set = made_set("grey:1,25,0",
                     "[[object]]\nname = \"pebble\"\nmesh = \"cube.obj\"\n"
                     "pose = { position = [4, 0, -2], scale = 0.1 }\n");
  set.stand_ins.clear();
  const std::vector<Taken> taken = take(set,
                                        "[[at]]\nframe = 4\nmove = \"pebble\"\n"
                                        "pose = { position = [4, 0, -1.8] }\n"
                                        "[[at]]\nframe = 6\nquit = true\n");
  ASSERT_EQ(taken.size(), 6U) << "a still is shown until its script ends";
  const auto rays = [&](std::size_t frame) {
    const render::RenderStatistics& s = taken[frame].statistics;
    return s.primary_rays + s.shadow_rays + s.secondary_rays;
  };
  EXPECT_EQ(rays(3), 0U);
  EXPECT_NE(taken[4].picture, taken[3].picture);
  EXPECT_GT(rays(4), 0U);
  EXPECT_LT(rays(4), rays(0) / 2);
  EXPECT_GT(taken[4].statistics.kept_rays, taken[3].statistics.kept_rays / 2);
  EXPECT_EQ(taken[5].picture, taken[4].picture);
}

// Else the first frame that shows a move waits for the scene's trees.
TEST_F(ScriptTest, HoldsApartWhatItMovesFromTheStart) {
  const Set set = made_set("grey:4,25,0", tv);
  ShowOptions options;
  options.script =
      script(set, "[[at]]\nframe = 2\nmove = \"set/tv\"\npose = { position = [1, 0, 0] }\n");
  std::vector<std::vector<std::string>> apart;
  Show show(set, options);
  show.run([&](const ShownFrame& shown) {
    std::vector<std::string>& names = apart.emplace_back();
    for (const render::Instance& instance : shown.prepared.scene->description().instances) {
      if (instance.moves) names.push_back(instance.name);
    }
  });
  ASSERT_EQ(apart.size(), 4U);
  ASSERT_FALSE(apart[0].empty());
  for (const std::string& name : apart[0]) EXPECT_THAT(name, testing::StartsWith("set/tv"));
  EXPECT_EQ(apart[3], apart[0]);
}

TEST_F(ScriptTest, DragsOverFramesAndGoesOnFromThere) {
  const std::vector<Taken> taken =
      take(made_set("grey:1,25,0"),
           "[[at]]\nframe = 7\nmove = \"cube\"\npose = { scale = 2 }\n"
           "[[at]]\nframe = 2\nuntil = 5\nmove = \"cube\"\npose = { position = [2, 0, 0] }\n"
           "[[at]]\nframe = 8\nuntil = 9\nmove = \"cube/\"\npose = { position = [0.5, 0, 0] }\n");
  std::vector<float> x;
  for (const Taken& frame : taken) x.push_back(frame.x);
  EXPECT_THAT(x, ElementsAre(0, 0, 0.5F, 1, 1.5F, 2, 2, 2, 2.5F, 3))
      << "not sorted, a position that is left out, and steps of a part in the scaled object";
}

TEST_F(ScriptTest, HoldsFromTheFirstFrameOnThatIsNotLeftOut) {
  ShowOptions options;
  options.live = true;
  const std::vector<Taken> taken =
      take(made_set("grey:1,25,0"),
           "[[at]]\nframe = 3\nmove = \"cube\"\npose = { position = [2, 0, 0] }\n"
           "[[at]]\nframe = 14\nquit = true\n",
           options, 90ms);
  EXPECT_LT(taken.size(), 14U);
  ASSERT_GT(taken.back().frame, 3);
  EXPECT_LT(taken.back().frame, 14);
  for (const Taken& frame : taken) EXPECT_EQ(frame.x, frame.frame < 3 ? 0 : 2) << frame.frame;
}

TEST_F(ScriptTest, ChangesEffortViewAndRecordingInTheirFrames) {
  const std::vector<Taken> taken = take(made_set("grey:1,25,0"),
                                        "[[at]]\nframe = 1\neffort = { aa_samples = 2 }\n"
                                        "[[at]]\nframe = 2\neffort = { light_samples = 8 }\n"
                                        "[[at]]\nframe = 2\nview = \"rays\"\n"
                                        "[[at]]\nframe = 2\nrecord = { exr = \"take\" }\n"
                                        "[[at]]\nframe = 4\nrecord = \"stop\"\n"
                                        "[[at]]\nframe = 4\nview = \"picture\"\n");
  std::vector<int> aa_samples;
  std::vector<bool> views;
  for (const Taken& frame : taken) {
    aa_samples.push_back(frame.aa_samples);
    views.push_back(frame.view);
  }
  EXPECT_THAT(aa_samples, ElementsAre(4, 2, 2, 2, 2));
  EXPECT_THAT(views, ElementsAre(false, false, true, true, false));
  std::vector<std::string> recorded;
  for (const auto& entry : std::filesystem::directory_iterator(dir_ / "take")) {
    recorded.push_back(entry.path().filename().string());
  }
  EXPECT_THAT(recorded, testing::UnorderedElementsAre("frame.000002.exr", "frame.000003.exr"));
  EXPECT_THAT(notes_, IsEmpty());
}

TEST_F(ScriptTest, ChangesTheVideoAndTheSetInTheirFrames) {
  capture::write_png(dir_ / "white.png", 8, 8, 3, std::vector<std::uint8_t>(8 * 8 * 3, 255));
  const std::string path = write_made_set(dir_, "grey:1,25,0", tv);
  std::ifstream in(path);
  std::string other(std::istreambuf_iterator<char>(in), {});
  other.replace(other.find("mesh = \"cube.obj\""), 17,
                "mesh = \"cube.obj\"\npose = { position = [2, 0, 0] }");
  const std::string other_path = write("other.toml", other);
  const Set set = read_set(path);
  const std::vector<Taken> taken =
      take(set,
           "[[at]]\nframe = 2\nvideo = \"news\"\nsource = \"white.png\"\n"
           "[[at]]\nframe = 4\nset = \"other.toml\"\n"
           "[[at]]\nframe = 5\nmove = \"cube\"\npose = { yaw = 10 }\n");
  ASSERT_EQ(taken.size(), 6U);
  EXPECT_THAT(notes_, IsEmpty());
  EXPECT_EQ(taken[1].picture, take(set)[0].picture);
  Set white = set;
  white.videos[0].source = "file:" + (dir_ / "white.png").string();
  EXPECT_EQ(taken[2].picture, take(white)[0].picture);
  EXPECT_EQ(taken[3].picture, taken[2].picture);
  EXPECT_EQ(taken[4].picture, take(read_set(other_path))[0].picture);
  EXPECT_EQ(taken[5].x, 2) << "from where the other set has it";
}

TEST_F(ScriptTest, PausesForAWhileWithoutChangingABit) {
  const Set set = made_set("grey:5,25,0");
  const auto start = std::chrono::steady_clock::now();
  const std::vector<Taken> taken = take(set, "[[at]]\nframe = 3\npause_s = 0.4\n");
  EXPECT_GE(std::chrono::steady_clock::now() - start, 400ms);
  EXPECT_EQ(pictures_of(taken), pictures_of(take(set)));
  // Time stands still meanwhile: nothing is late.
  ShowOptions options;
  options.live = true;
  options.frames = 3;
  Show show(made_set("grey:1000,5,0"), [&] {
    ShowOptions paused = options;
    paused.script = script(set, "[[at]]\nframe = 2\npause_s = 1\n");
    return paused;
  }());
  show.run();
  EXPECT_EQ(show.status()->frame, 2);
}

TEST_F(ScriptTest, IsRefusedWithThePlaceAndWhatToWrite) {
  const Set set = made_set("grey:9,25,0", tv);
  const auto expect_fault = [&](const std::string& text, const std::string& fault) {
    EXPECT_THAT(faults_of(set, text), HasSubstr(fault)) << text;
  };
  const std::string at = "[[at]]\nframe = 5\n";
  EXPECT_EQ(faults_of(set, at + "quit = true\n"), "");
  expect_fault("", "at is missing: a script has [[at]] with a frame and what happens then");
  expect_fault("[[at]\n", "1:6: ");
  expect_fault("[[at]]\nquit = true\n", "1:1: at.frame is missing");
  expect_fault("[[at]]\nframe = -1\nquit = true\n", "2:9: at.frame is -1, but must be from 0");
  expect_fault(at, "1:1: at must say what happens: move, video, effort");
  expect_fault(at + "mvoe = \"cube\"\n", "3:1: unknown key at.mvoe: did you mean move?");
  expect_fault(at + "view = \"rays\"\nquit = true\n",
               "4:8: at.quit comes beside at.view: one [[at]] for each");
  expect_fault(
      at + "move = \"kube\"\npose = {}\n",
      "3:8: at.move is \"kube\", but the set has no such object: there are \"cube\", \"set\"");
  expect_fault(at + "move = \"cube\"\n", "1:1: at.pose is missing");
  expect_fault(at + "move = \"cube\"\npose = { turn = 3 }\n", "4:10: unknown key at.pose.turn");
  expect_fault(at + "move = \"cube\"\npose = {}\nuntil = 4\n",
               "5:9: at.until is 4, but must be from 5");
  expect_fault(at + "move = \"cube\"\npose = {}\nuntil = 99999999\n",
               "a script has at most 100000");
  expect_fault(
      at + "until = 9\nmove = \"cube\"\npose = {}\n[[at]]\nframe = 7\nmove = \"cube\"\npose = {}\n",
      "8:8: at.move is \"cube\", which is on its way until frame 9, by line 1");
  expect_fault(at + "move = \"cube/wheel\"\npose = {}\n",
               "1:1: object \"cube\" has no part \"wheel...\"; it has: ");
  expect_fault(at + "video = \"weather\"\nsource = \"cube.obj\"\n",
               "3:9: at.video is \"weather\", but the set has no such video: there are \"news\"");
  expect_fault(at + "video = \"news\"\nsource = \"absent.mp4\"\n", "4:10: at.source names ");
  expect_fault(at + "video = \"news\"\nsource = \"sky.exr\"\nuntil = 9\n",
               "5:9: at.until is of use only with at.move");
  expect_fault(at + "video = \"news\"\nsource = \"cube.obj\"\n", "4:10: cannot open ");
  expect_fault(at + "effort = { interleave = 3 }\n",
               "3:25: at.effort.interleave must be 1, 2 or 4");
  expect_fault(at + "view = \"colours\"\n",
               "3:8: at.view is \"colours\", but must be picture, or one of depth, rays");
  expect_fault(at + "record = {}\n", "3:10: at.record names nothing to record");
  expect_fault(at + "record = true\n", "3:10: at.record must be a table");
  expect_fault(at + "record = \"stop\"\n",
               "3:10: at.record is \"stop\", but nothing is being recorded");
  expect_fault(at + "record = { file = \"no/folder/take.mkv\" }\n", "1:1: ");
  expect_fault(
      at + "record = { file = \"a.mkv\" }\n[[at]]\nframe = 6\nrecord = { file = \"a.mkv\" }\n",
      "4:1: " + (dir_ / "a.mkv").string() + " is what is recorded to, and would be lost");
  expect_fault(at + "pause_s = 0\n", "3:11: at.pause_s is 0, but must be from 0.001 to 3600");
  expect_fault(at + "quit = false\n", "3:8: at.quit can only be true");
  expect_fault(at + "quit = true\n[[at]]\nframe = 5\nview = \"rays\"\n",
               "4:1: at is never reached: the show quits at frame 5, by line 1");
  EXPECT_FALSE(std::filesystem::exists(dir_ / "a.mkv"));
}

TEST_F(ScriptTest, IsRefusedForTheFaultsOfTheSetsThatItChangesTo) {
  const std::string path = write_made_set(dir_, "grey:9,25,0");
  std::ifstream in(path);
  const std::string text(std::istreambuf_iterator<char>(in), {});
  const auto faults_with = [&](const std::string& of, const std::string& by) {
    std::string other = text;
    other.replace(other.find(of), of.size(), by);
    write("other.toml", other);
    return faults_of(read_set(path), "[[at]]\nframe = 5\nset = \"other.toml\"\n");
  };
  EXPECT_EQ(faults_with("[20, 20]", "[30, 20]"), "");
  EXPECT_THAT(faults_with("[20, 20]", "[20]"),
              HasSubstr((dir_ / "other.toml").string() + ":17:8: stand_in.size has 1 numbers"));
  EXPECT_THAT(faults_with("width = 64", "width = 65"),
              AllOf(HasSubstr("3:7: at.set names "), HasSubstr("size and rate cannot change")));
  EXPECT_THAT(faults_with("grey:9", "grey:8"), HasSubstr("plate's source cannot change"));
  write("broken.obj", "no model\n");
  EXPECT_THAT(faults_with("cube.obj", "broken.obj"), HasSubstr("other.toml:"));
  EXPECT_THAT(faults_of(read_set(path), "[[at]]\nframe = 5\nset = \"absent.toml\"\n"),
              HasSubstr("3:7: at.set names "));
}

// As operators run them.
class ScriptedRuns : public CommandLine {
 protected:
  std::string write_set() const {
    capture::write_png(dir_ / "plate.png", 64, 48, 3, std::vector<std::uint8_t>(64 * 48 * 3, 120));
    return write_made_set(dir_, "file:plate.png");
  }
};

TEST_F(ScriptedRuns, DoWhatTheirScriptSaysAndTellWhatWasNotReached) {
  const std::string set = write_set(), json = (dir_ / "run.json").string();
  const std::string script = write("rehearsal.toml",
                                   "[[at]]\nframe = 1\nrecord = { file = \"take.mkv\" }\n"
                                   "[[at]]\nframe = 3\nrecord = \"stop\"\n"
                                   "[[at]]\nframe = 5\nquit = true\n");
  const Outcome outcome = run("run " + set + " --script " + script + " --json " + json);
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(outcome.out, HasSubstr("recorded 2 frames to " + (dir_ / "take.mkv").string()));
  const auto figures = nlohmann::json::parse(content_of(json));
  EXPECT_EQ(figures["frames"], 5);
  EXPECT_EQ(figures["recorder"]["written"], 2);

  const Outcome shorter = run("run " + set + " --frames 2 --script " + script);
  EXPECT_EQ(shorter.status, 0);
  EXPECT_THAT(shorter.err, HasSubstr(script + ":4:1: frame 3 was not reached"));

  const std::string odd = write("rehearsal.png", content_of(script));
  const Outcome over_it = run("run " + set + " --script " + odd + " --view rays --view-png " + odd);
  EXPECT_EQ(over_it.status, 1);
  EXPECT_THAT(over_it.err, HasSubstr("is the script, and would be lost"));
  EXPECT_EQ(content_of(odd), content_of(script));

  const std::string bad = write("bad.toml", "[[at]]\nframe = 1\nmove = \"kube\"\npose = {}\n");
  const Outcome refused = run("run " + set + " --record no.mkv --script " + bad);
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.err, HasSubstr(bad + ":3:8: at.move is \"kube\""));
  EXPECT_FALSE(fs::exists("no.mkv"));
}

TEST_F(ScriptedRuns, ApplyTheirOptionsToSetsThatTheScriptChangesTo) {
  const std::string set = write_set();
  write("other.toml", content_of(set) + "[record]\nfile = \"other.mkv\"\n");
  const std::string script = write("rehearsal.toml", "[[at]]\nframe = 1\nset = \"other.toml\"\n");
  const Outcome told = run("run " + set + " --script " + script);
  EXPECT_EQ(told.status, 0);
  EXPECT_THAT(told.err, HasSubstr(script + ":1:1: [record] of " + (dir_ / "other.toml").string()));
  const std::string take = (dir_ / "take.mkv").string();
  const Outcome same = run("run " + set + " --script " + script + " --record " + take);
  EXPECT_EQ(same.err, "");
  EXPECT_THAT(same.out, HasSubstr("recorded 2 frames to " + take));
}

}  // namespace
}  // namespace studio::script_test
