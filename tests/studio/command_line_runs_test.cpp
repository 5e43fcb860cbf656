// Shows on the command line: run and still, as operators and their scripts see them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "calibrate/lens.h"
#include "capture/camera.h"
#include "capture/exr.h"
#include "capture/png.h"
#include "studio/command.h"
#include "studio/commands/benches.h"
#include "studio/commands/interruptible.h"
#include "tests/studio/made_show.h"
#include "tests/studio/runs.h"

namespace studio::command_line_runs_test {
namespace {

using testing::HasSubstr;

TEST_F(Runs, WriteTheFiguresThatScriptsRelyOn) {
  const std::string json_path = (dir_ / "run.json").string();
  const Outcome outcome = run("run " + write_set() + " --frames 3 --json " + json_path);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto json = nlohmann::json::parse(content_of(json_path));
  EXPECT_EQ(json["frames"], 3);
  EXPECT_EQ(json["dropped"], 0);
  EXPECT_GT(json["fps"], 0);
  EXPECT_GT(json["frame_ms"]["p50"], 0);
  EXPECT_GE(json["frame_ms"]["p99"], json["frame_ms"]["p50"]);
  for (const char* stage : {"capture", "probe", "job", "render", "display", "record"}) {
    EXPECT_TRUE(json["stage_ms"][stage].is_number()) << stage;
  }
  for (const char* kind : {"primary", "shadow", "secondary"}) {
    EXPECT_GT(json["rays"][kind], 0) << kind;
  }
  EXPECT_GT(json["delay_frames"], 0);
  EXPECT_EQ(json["match"], nlohmann::json::array({1.0, 1.0, 1.0}));
  EXPECT_GT(json["peak_memory_mb"], 1);
  EXPECT_LT(json["peak_memory_mb"], 1024);
}

TEST_F(Runs, NameTheCommandThatMeasuresEffortIfItWasNotMeasured) {
  const Outcome outcome = run("run " + write_set() + " --fps 25");
  EXPECT_EQ(outcome.status, 1);
  expect_one_line(outcome.err);
  EXPECT_THAT(outcome.err, HasSubstr("platelight chart set"));
}

TEST_F(Runs, TakeTheEffortThatTheChartOfTheirSetFoundBest) {
  const std::string set = write_set();
  const Outcome chart = run("chart set " + set + " --quick --samples 4");
  ASSERT_EQ(chart.status, 0) << chart.err;
  const std::string json_path = (dir_ / "run.json").string();
  const Outcome slow = run("run " + set + " --frames 1 --fps 0.01 --json " + json_path);
  ASSERT_EQ(slow.status, 0) << slow.err;
  const auto points =
      nlohmann::json::parse(content_of(set.substr(0, set.size() - 5) + ".chart.json"))["points"];
  ASSERT_GE(points.size(), 2);
  const auto best =
      std::min_element(points.begin(), points.end(),
                       [](const auto& a, const auto& b) { return a["error"] < b["error"]; });
  const auto taken = nlohmann::json::parse(content_of(json_path))["effort"];
  for (const char* name : {"aa_samples", "light_samples", "interleave"}) {
    EXPECT_EQ(taken[name].get<int>(), (*best)["settings"][name].get<int>()) << name;
  }
  for (const char* name : {"aa_tolerance", "glint_contrast", "accuracy"}) {
    EXPECT_NEAR(taken[name].get<double>(), (*best)["settings"][name].get<double>(), 1e-6) << name;
  }
  EXPECT_EQ(slow.err, "");
  std::ofstream(set, std::ios::app) << "max_depth = 32\n";  // of [effort]
  const Outcome changed = run("run " + set + " --frames 1 --fps 0.01");
  EXPECT_EQ(changed.status, 0);
  expect_one_line(changed.err);
  EXPECT_THAT(changed.err, HasSubstr("platelight chart set"));
  const Outcome hopeless = run("run " + set + " --frames 1 --error 0");
  EXPECT_EQ(hopeless.status, 0);
  EXPECT_THAT(hopeless.err, HasSubstr("no measured setting is within 0 %"));
  EXPECT_EQ(run("run " + set + " --fps 25 --error .01").status, 2);
}

TEST_F(Runs, AreChartedWithoutWritingOverTheirTakes) {
  write_set();  // its plate
  const std::string set = write_made_set(
      dir_, "file:plate_%d.png",
      "[record]\nfile = \"take.mkv\"\nfill = \"fill.mkv\"\nkey = \"key.mkv\"\nexr = \"take\"\n");
  for (const char* take : {"take.mkv", "fill.mkv", "key.mkv"}) write(take, "yesterday's");
  const Outcome outcome = run("chart set " + set + " --quick --samples 2");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  for (const char* take : {"take.mkv", "fill.mkv", "key.mkv"}) {
    EXPECT_EQ(content_of(dir_ / take), "yesterday's") << take;
  }
  EXPECT_FALSE(fs::exists(dir_ / "take"));
}

TEST_F(Runs, AreNotChartedWithoutAnythingVirtual) {
  write_set();  // its plate
  const std::string set = write("bare.toml",
                                "[show]\nwidth = 64\nheight = 48\n"
                                "[camera]\nsource = \"file:plate_%d.png\"\n");
  const Outcome outcome = run("chart set " + set + " --quick --samples 2");
  EXPECT_EQ(outcome.status, 1);
  expect_one_line(outcome.err);
  EXPECT_THAT(outcome.err, HasSubstr("shows nothing virtual"));
  EXPECT_FALSE(fs::exists(dir_ / "bare.chart.json"));
}

TEST_F(Runs, TellWhatTheirInputsCost) {
  const std::string json_path = (dir_ / "inputs.json").string();
  const Outcome outcome = run("bench inputs --set " + write_set() + " --json " + json_path);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto json = nlohmann::json::parse(content_of(json_path));
  EXPECT_EQ(json["frames"], 2) << "all but the first";
  EXPECT_GT(json["cpu_ms"], 0);
  EXPECT_TRUE(json["stage_ms"]["probe"].is_number());
}

TEST_F(Runs, TellWhatInputsOfAStillPlateCostAndEnd) {
  write_set();  // its plate
  const std::string json_path = (dir_ / "inputs.json").string();
  const Outcome outcome = run("bench inputs --runs 1 --frames 5 --set " +
                              write_made_set(dir_, "file:plate_0.png") + " --json " + json_path);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(content_of(json_path))["frames"], 4);
}

using LiveInputs = MadeShowTest;

// Counts the pictures that a live camera has given.
class CountedGreyCamera final : public capture::Camera {
 public:
  explicit CountedGreyCamera(std::atomic<int>& given) : camera_(1000, {50, 1}, 0), given_(given) {}
  const capture::CameraInfo& info() const override { return camera_.info(); }
  capture::CameraStatistics statistics() const override { return camera_.statistics(); }
  std::optional<capture::Frame> next() override {
    auto frame = camera_.next();
    ++given_;
    return frame;
  }

 private:
  LiveGreyCamera camera_;
  std::atomic<int>& given_;
};

TEST_F(LiveInputs, AreMeasuredAsThePicturesCome) {
  std::atomic<int> given = 0;
  capture::register_camera("counted", [&](std::string_view, const capture::CameraOptions&) {
    return std::make_unique<CountedGreyCamera>(given);
  });
  Console console(true, "");
  bench_inputs(write_made_set(dir_, "counted:"), 1, 40, console);
  EXPECT_GE(given, 20);
}

using BreakingInputs = MadeShowTest;

// A camera that cannot be read from its sixth frame on.
class BreakingCamera final : public GreyCamera {
 public:
  BreakingCamera() : GreyCamera(100, {25, 1}, 0) {}
  std::optional<capture::Frame> next() override {
    auto frame = GreyCamera::next();
    if (frame && frame->number == 5) throw std::runtime_error("its disk is gone");
    return frame;
  }
};

TEST_F(BreakingInputs, LeaveTheFiguresOfTheFramesBefore) {
  capture::register_camera("breaking", [](std::string_view, const capture::CameraOptions&) {
    return std::make_unique<BreakingCamera>();
  });
  const std::string set = write_made_set(dir_, "breaking:");
  const std::string json_path = (dir_ / "run.json").string();
  const std::array words{"platelight", "run", set.c_str(), "--quiet", "--json", json_path.c_str()};
  const auto run = [&] { run_command_line(static_cast<int>(words.size()), words.data()); };
  EXPECT_THAT(run, testing::ThrowsMessage<std::runtime_error>(HasSubstr("its disk is gone")));
  const auto figures = nlohmann::json::parse(content_of(json_path));
  EXPECT_GT(figures["frames"], 0);
  EXPECT_LT(figures["frames"], 6);
  EXPECT_GT(figures["rays"]["primary"], 0);
}

TEST_F(Runs, CountInTensWhateverNumbersBeginWith) {
  write_set();  // its plate
  const std::string json_path = (dir_ / "run.json").string();
  const std::string command =
      "run " + write_made_set(dir_, "file:plate_0.png") + " --json " + json_path + " --frames ";
  for (const auto& [given, frames] : {std::pair{"010", 10}, {"08", 8}, {"+0009", 9}}) {
    const Outcome outcome = run(command + given);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(nlohmann::json::parse(content_of(json_path))["frames"], frames) << given;
  }
  EXPECT_EQ(run(command + "00").status, 2);
}

TEST_F(Runs, TellEveryNoteOfTheirModels) {
  write_set();  // its plate
  std::string objects;
  for (const std::string name : {"a", "b", "c", "d", "e", "f", "g", "h"}) {
    write(name + ".obj",
          "mtllib lost_" + name + ".mtl\no " + name + "\nv 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n");
    objects += "[[object]]\nname = \"sign " + name + "\"\nmesh = \"" + name + ".obj\"\n";
  }
  const std::string set = write_made_set(dir_, "file:plate_0.png", objects);
  const std::string png = (dir_ / "still.png").string();
  for (const std::string& words : {"run " + set + " --frames 2", "still " + set + " -o " + png}) {
    const Outcome outcome = run(words);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    for (const std::string name : {"a", "b", "c", "d", "e", "f", "g", "h"}) {
      EXPECT_THAT(outcome.err, HasSubstr("'lost_" + name + ".mtl' is not there"));
      EXPECT_THAT(outcome.err, HasSubstr("'" + name + ".mtl' is not there"));
    }
  }
}

TEST_F(Runs, RecordVideoAndExr) {
  const std::string take = (dir_ / "take.mkv").string();
  const Outcome outcome = run("run --quiet " + write_set() + " --record " + take + " --exr " +
                              (dir_ / "take").string());
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.out + outcome.err, "");
  EXPECT_GT(fs::file_size(take), 500U);
  EXPECT_EQ(std::distance(fs::directory_iterator(dir_ / "take"), fs::directory_iterator()), 3);
}

TEST_F(Runs, RecordToWhatTheirOptionsNameAndNothingElse) {
  write_set();  // its plate
  const std::string set =
      write_made_set(dir_, "file:plate_%d.png",
                     "[record]\nexr = \"re\"\nfile = \"set.mkv\"\ncodec = \"lossless\"\n");
  const std::string take = (dir_ / "take.mkv").string();
  const Outcome outcome = run("run " + set + " --record " + take);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("3 frames to " + take));
  EXPECT_TRUE(fs::exists(take));
  EXPECT_FALSE(fs::exists(dir_ / "re"));
  EXPECT_FALSE(fs::exists(dir_ / "set.mkv"));
}

TEST_F(Runs, SayWhichCodecTakesAnOddSize) {
  const std::vector<std::uint8_t> grey(63 * 48 * 3, 120);
  capture::write_png(dir_ / "odd.png", 63, 48, 3, grey);
  std::string set = content_of(write_made_set(dir_, "file:odd.png"));
  set.replace(set.find("width = 64"), 10, "width = 63");
  const std::string odd = write("odd.toml", set);
  const std::string record = "run " + odd + " --frames 1 --record " + (dir_ / "take.mkv").string();
  EXPECT_THAT(run(record).err, HasSubstr("[record] codec = \"lossless\" takes any"));
  write("odd.toml", set + "[record]\ncodec = \"lossless\"\n");
  EXPECT_EQ(run(record).status, 0);
}

TEST_F(Runs, SayThatTheirTakeMayGrowNoLarger) {
  const std::string take = (dir_ / "take.mkv").string();
  const Outcome outcome = run("run --quiet " + write_set() + " --record " + take, "ulimit -f 1 &&");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.err, HasSubstr(take));
  EXPECT_THAT(outcome.err, HasSubstr("File too large"));
}

// A facility may have its own displays and views.
TEST_F(Runs, AreShownTheSameWhateverTheEnvironmentSaysOfColour) {
  const std::string set = write_set();
  const std::string plain = (dir_ / "plain.png").string(), other = (dir_ / "other.png").string();
  ASSERT_EQ(run("still " + set + " -o " + plain).status, 0);
  const Outcome outcome = run("still " + set + " -o " + other,
                              "OCIO_ACTIVE_DISPLAYS=sRGB OCIO_ACTIVE_VIEWS=Film "
                              "OCIO_OPTIMIZATION_FLAGS=0");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(content_of(other), content_of(plain));
}

TEST_F(Runs, RecordFillAndKeyForAnExternalKeyer) {
  const auto path = [&](const char* name) { return (dir_ / name).string(); };
  const Outcome outcome = run("run " + write_set() + " --fill " + path("fill.mkv") + " --key " +
                              path("key.mkv") + " --json " + path("run.json"));
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out,
              HasSubstr("recorded 3 frames to " + path("fill.mkv") + " and " + path("key.mkv")));
  EXPECT_GT(fs::file_size(path("fill.mkv")), 500U);
  EXPECT_GT(fs::file_size(path("key.mkv")), 500U);
  const auto json = nlohmann::json::parse(content_of(path("run.json")));
  EXPECT_LT(json["recorder"]["key_raised"], 1);
}

// As an operator ends a show that has no end.
TEST_F(Runs, EndOnASignalWithTheirTakeWhole) {
  write_set();  // its plate
  const std::string set = write_made_set(dir_, "file:plate_0.png");
  const std::string take = (dir_ / "take.mkv").string(), json_path = (dir_ / "run.json").string();
  for (const char* signal : {"INT", "TERM", "HUP"}) {
    const Outcome outcome =
        run("run " + set + " --frames 1000000 --record " + take + " --json " + json_path,
            "timeout --preserve-status -s " + std::string(signal) + " 4");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const auto json = nlohmann::json::parse(content_of(json_path));
    EXPECT_GT(json["frames"], 0);
    EXPECT_LT(json["frames"], 1000000);
    EXPECT_EQ(json["recorder"]["written"], json["frames"]);
    const auto camera = capture::open_camera("file:" + take);
    EXPECT_EQ(camera->info().frames, json["frames"]);
  }
}

TEST(Interruptible, EndsTheProgramOnASecondSignalOfAnyKind) {
  const auto interrupt_by = [](int second) {
    for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, SIG_DFL);
    std::signal(SIGHUP, SIG_IGN);
    const Interruptible interruptible;
    std::raise(SIGINT);
    std::raise(SIGHUP);  // as the program was told
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    if (interruptible.is_interrupted()) std::raise(second);
    std::_Exit(0);
  };
  EXPECT_EXIT(interrupt_by(SIGTERM), testing::KilledBySignal(SIGTERM), "");
  EXPECT_EXIT(interrupt_by(SIGINT), testing::KilledBySignal(SIGINT), "");
}

// As `timeout` sends its signal to a program and to the program's group.
TEST(Interruptible, TakesSignalsThatComeTogetherForOne) {
  const auto interrupt = [] {
    for (const int signal : {SIGINT, SIGHUP}) std::signal(signal, SIG_DFL);
    const Interruptible interruptible;
    for (const int signal : {SIGINT, SIGINT, SIGHUP}) std::raise(signal);
    std::_Exit(interruptible.is_interrupted() ? 3 : 0);
  };
  EXPECT_EXIT(interrupt(), testing::ExitedWithCode(3), "");
}

TEST_F(Runs, AreNotRecordedOverWhatTheirSetIsMadeFrom) {
  const std::string take = (dir_ / "take.mkv").string(), frames = (dir_ / "take").string();
  const std::string first = write_set();
  ASSERT_EQ(run("run " + first + " --record " + take + " --exr " + frames).status, 0);
  const std::string set = write_made_set(dir_, "file:take.mkv");
  const auto expect_spared = [&](const std::string& words, const std::string& path) {
    const std::string before = content_of(path);
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.status, 1) << words;
    EXPECT_THAT(outcome.err, HasSubstr("would be lost")) << words;
    EXPECT_EQ(content_of(path), before) << words;
  };
  expect_spared("run " + set + " --record " + (dir_ / "." / "take.mkv").string(), take);
  expect_spared("run " + set + " --json " + set, set);
  expect_spared("still " + set + " -o " + set, set);
  expect_spared("check " + set + " --json " + set, set);
  fs::create_hard_link(take, dir_ / "other.mkv");
  expect_spared("run " + set + " --record " + (dir_ / "other.mkv").string(), take);
  // What keys name, and what a frame of a take would replace.
  fs::create_directories(dir_ / "light");
  fs::copy_file(dir_ / "sky.exr", dir_ / "light" / "frame.000001.exr");
  const std::string lens = (dir_ / "lens.toml").string();
  calibrate::write_lens(lens, {"pinhole", 64, 48, {60, 60, 31.5, 23.5}});
  std::string with_lens = content_of(set);
  for (const auto& [of, by] : {std::pair<std::string, std::string>{
                                   "model = \"pinhole\"\nfocal_px = 60", "lens = \"lens.toml\""},
                               {"sky.exr", "light/frame.000001.exr"}}) {
    with_lens.replace(with_lens.find(of), of.size(), by);
  }
  const std::string lensed = write("lensed.toml", with_lens);
  expect_spared("still " + lensed + " -o " + lens, lens);
  expect_spared("run " + lensed + " --exr " + (dir_ / "light").string(),
                (dir_ / "light" / "frame.000001.exr").string());
  const std::string broken = write("broken.toml", "[show]\nwidth = \"wide\"\n");
  expect_spared("check " + broken + " --json " + broken, broken);
  write_set();
  expect_spared("still " + set + " -o " + (dir_ / "plate_1.png").string(),
                (dir_ / "plate_1.png").string());
  write("cube.mtl", "newmtl paint\nmap_Kd paint.png\n");
  capture::write_png(dir_ / "paint.png", 1, 1, 3, std::vector<std::uint8_t>(3, 200));
  expect_spared("still " + set + " -o " + (dir_ / "paint.png").string(),
                (dir_ / "paint.png").string());
  EXPECT_THAT(run("still " + set + " -o " + (dir_ / "still.jpg").string()).err,
              HasSubstr("PNG files"));
  const std::string both = (dir_ / "both.mkv").string();
  EXPECT_THAT(run("run " + set + " --record " + both + " --json " + both).err,
              HasSubstr("would be lost"));
  write_made_set(dir_, "file:take/frame.%06d.exr");
  expect_spared("run " + set + " --exr " + frames, frames + "/frame.000000.exr");
}

TEST_F(Runs, StopWhenTheyAreNoLongerRecorded) {
  write_set();  // its plate
  const std::string set = write_made_set(dir_, "file:plate_0.png");
  const fs::path full = dir_ / "full.mkv";
  fs::create_symlink("/dev/full", full);
  const std::string json_path = (dir_ / "run.json").string();
  const Outcome outcome =
      run("run " + set + " --frames 1000000 --record " + full.string() + " --json " + json_path);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.err, HasSubstr("No space left on device"));
  EXPECT_LT(nlohmann::json::parse(content_of(json_path))["frames"], 1000000);
}

TEST_F(Runs, RefuseAPairThatIsNone) {
  const std::string set = write_set();
  const std::string fill = (dir_ / "fill.mkv").string(), key = (dir_ / "key.mov").string();
  for (const std::string& half : {" --fill " + fill, " --key " + fill}) {
    const Outcome outcome = run("run " + set + half);
    EXPECT_EQ(outcome.status, 2);
    EXPECT_THAT(outcome.err, HasSubstr("--fill and --key"));
  }
  for (const std::string& other : {fill, key}) {
    const Outcome outcome = run("run " + set + " --fill " + fill + " --key " + other);
    EXPECT_EQ(outcome.status, 1);
    expect_one_line(outcome.err);
    EXPECT_THAT(outcome.err, HasSubstr(other));
    EXPECT_FALSE(fs::exists(fill));
  }
}

TEST_F(Runs, CheckTheErrorOfTheLastFrame) {
  const std::string json_path = (dir_ / "run.json").string();
  const Outcome outcome =
      run("run " + write_set() + " --frames 1 --check-error 64 --json " + json_path);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto error = nlohmann::json::parse(content_of(json_path))["error"];
  EXPECT_GT(error["relative_rms"], 0);
  EXPECT_LT(error["relative_rms"], 0.5);
  EXPECT_GT(error["reference_noise"], 0);
  EXPECT_LT(error["reference_noise"], 0.5);
  EXPECT_GT(error["pixels"], 100);
}

TEST_F(Runs, FailWithOneLineWhenTheRecordingCannotBegin) {
  const Outcome outcome = run("run " + write_set() + " --record /proc/nowhere/take.mkv");
  EXPECT_EQ(outcome.status, 1);
  expect_one_line(outcome.err);
}

TEST_F(Runs, DrawOverlaysOverAStill) {
  const std::string set = write_set();
  const std::string plain = (dir_ / "plain.png").string();
  const std::string drawn = (dir_ / "drawn.png").string();
  EXPECT_EQ(run("still " + set + " -o " + plain).status, 0);
  const Outcome outcome =
      run("still " + set + " -o " + drawn + " --overlay grid,axes,stand_in,coverage,light");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  const std::string before = (dir_ / "before.png").string();
  const Outcome options_first =
      run("still --overlay grid,axes,stand_in --overlay coverage,light " + set + " -o " + before);
  EXPECT_EQ(options_first.status, 0) << options_first.err;
  EXPECT_EQ(content_of(before), content_of(drawn));
  EXPECT_TRUE(content_of(plain).starts_with("\x89PNG"));
  EXPECT_NE(content_of(plain), content_of(drawn));
  EXPECT_EQ(run("still " + set).status, 2);
  EXPECT_EQ(run("still " + set + " -o " + plain + " --overlay gird").status, 2);
}

TEST_F(Runs, ShowWhatPixelsTookInPlaceOfThePicture) {
  const std::string set = write_set();
  const std::string json = (dir_ / "still.json").string();
  std::vector<std::string> pictures;
  for (const std::string view : {"depth", "rays", "shadow_rays", "error"}) {
    const fs::path png = dir_ / (view + ".png");
    const Outcome outcome =
        run("still " + set + " -o " + png.string() + " --view " + view + " --json " + json);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    const std::string content = content_of(png);
    EXPECT_TRUE(content.starts_with("\x89PNG"));
    EXPECT_EQ(std::ranges::count(pictures, content), 0) << view;
    pictures.push_back(content);
    const nlohmann::json figures = nlohmann::json::parse(content_of(json))["per_pixel"];
    EXPECT_EQ(figures.size(), 4U);
    EXPECT_GE(figures["rays"]["mean"], 1);
    EXPECT_GE(figures[view]["max"], figures[view]["mean"]);
  }
  const std::string last = (dir_ / "last.png").string();
  EXPECT_EQ(run("run " + set + " --frames 3 --view rays --view-png " + last).status, 0);
  EXPECT_EQ(content_of(last), pictures[1]);
  EXPECT_EQ(run("still " + set + " -o " + last + " --view colours").status, 2);
  const Outcome other = run("run " + set + " --view rays --view-png " + (dir_ / "a.jpg").string());
  EXPECT_EQ(other.status, 2);
  EXPECT_THAT(other.err, HasSubstr("names a .png file"));
  const std::string both = (dir_ / "both.png").string();
  const Outcome twice = run("run " + set + " --view-png " + both + " --json " + both);
  EXPECT_EQ(twice.status, 2) << twice.err;
  EXPECT_THAT(twice.err, HasSubstr("name one file"));
}

TEST_F(Runs, ConvertAnHdrPicture) {
  write_set();
  const std::string out = (dir_ / "out.exr").string();
  const std::string json = (dir_ / "hdr.json").string();
  const Outcome outcome =
      run("hdr " + (dir_ / "sky.exr").string() + " -o " + out + " --json " + json);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(capture::read_exr(out).pixels, capture::read_exr((dir_ / "sky.exr").string()).pixels);
  for (const char* key : {"exposures_s", "response", "stops", "time_ms"}) {
    EXPECT_TRUE(nlohmann::json::parse(content_of(json)).contains(key)) << key;
  }
  EXPECT_EQ(run("hdr " + (dir_ / "sky.exr").string() + " -o out.jpg").status, 2);
  const std::string before = content_of(out);
  for (const std::string& lossy : {" -o " + out, " -o " + json + ".exr --json " + out}) {
    const Outcome refused = run("hdr " + out + lossy);
    EXPECT_EQ(refused.status, 1) << lossy;
    EXPECT_THAT(refused.err, HasSubstr("would be lost")) << lossy;
  }
  EXPECT_EQ(content_of(out), before);
  EXPECT_EQ(run("hdr " + (dir_ / "absent.jpg").string() + " -o " + out).status, 1);
}

}  // namespace
}  // namespace studio::command_line_runs_test
