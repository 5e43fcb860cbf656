// The program as its users and their scripts see it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "capture/camera.h"
#include "capture/camera_response.h"
#include "capture/exr.h"
#include "capture/made_sensor.h"
#include "capture/png.h"
#include "studio/command.h"
#include "tests/studio/command_line.h"
#include "tests/studio/made_show.h"

namespace studio::command_line_test {
namespace {

using testing::HasSubstr;

constexpr const char* good_set =
    "[show]\nwidth = 64\nheight = 48\n[camera]\nsource = \"file:plate.png\"\n";

// Writes such a set, and its plate.
class CheckedSets : public CommandLine {
 protected:
  std::string write_good(const std::string& more = "") const {
    capture::write_png(dir_ / "plate.png", 64, 48, 3, std::vector<std::uint8_t>(64 * 48 * 3, 120));
    return write("a.toml", good_set + more);
  }
};

TEST_F(CommandLine, ShowsAnExampleOfEveryCommand) {
  for (const Command& command : commands()) {
    const Outcome outcome = run(std::string(command.name) + " --help");
    EXPECT_EQ(outcome.status, 0) << command.name;
    EXPECT_THAT(outcome.out, HasSubstr("Example"));
    EXPECT_THAT(outcome.out, HasSubstr(std::string("platelight ") + std::string(command.name)));
    EXPECT_THAT(outcome.out, HasSubstr("--json"));
    EXPECT_THAT(outcome.out, HasSubstr("--quiet"));
    EXPECT_EQ(outcome.err, "");
  }
}

TEST_F(CommandLine, ListsEveryCommand) {
  const Outcome outcome = run("--help");
  EXPECT_EQ(outcome.status, 0);
  for (const Command& command : commands()) {
    const std::string name(command.name);
    const std::size_t space = name.find(' ');
    const bool grouped = space != std::string::npos;
    const std::string listed = grouped ? run(name.substr(0, space) + " --help").out : outcome.out;
    EXPECT_THAT(listed, HasSubstr(std::string(command.summary)));
    EXPECT_THAT(outcome.out, HasSubstr(std::string(command.group_summary)));
  }
}

TEST_F(CommandLine, FindsCommandsOfTwoWords) {
  EXPECT_EQ(run("calibrate").status, 2);
  EXPECT_EQ(run("calibrate respons").status, 2);
  const Outcome outcome = run("calibrate response");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_THAT(outcome.err, HasSubstr("platelight calibrate response --help"));
  EXPECT_EQ(run("calibrate --help").status, 0);
}

TEST_F(CommandLine, ReturnsTwoAndOneLineForWrongUsage) {
  for (const char* words : {"", "chek", "check", "check a.toml b.toml", "check --frobnicate a.toml",
                            "check a.toml --json", "--frobnicate"}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.status, 2) << words;
    expect_one_line(outcome.err);
    EXPECT_THAT(outcome.err, HasSubstr("--help"));
    EXPECT_EQ(outcome.out, "");
  }
}

TEST_F(CommandLine, TellsHowToWriteAListThatIsGivenWithSpaces) {
  for (const char* words :
       {"still a.toml -o a.png --overlay grid axes", "still --overlay grid axes a.toml -o a.png",
        "still --overlay grid, axes -o a.png a.toml"}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.status, 2) << words;
    expect_one_line(outcome.err);
    EXPECT_THAT(outcome.err, HasSubstr("\"axes\" was not expected: write --overlay grid,axes"));
  }
  EXPECT_THAT(run("still a.toml b.toml --overlay grid -o a.png").err, HasSubstr("b.toml"));
}

TEST_F(CommandLine, TakesNoNumberThatIsNone) {
  for (const char* words : {"run a.toml --error nan", "run a.toml --fps -NaN",
                            "capture record v4l2:/dev/none take --seconds nan"}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.status, 2) << words;
    expect_one_line(outcome.err);
    EXPECT_THAT(outcome.err, HasSubstr("is not a number")) << words;
  }
}

TEST_F(CommandLine, MakesNoDemoOfAnOddWidth) {
  const Outcome outcome = run("demo " + (dir_ / "made").string() + " --width 301");
  EXPECT_EQ(outcome.status, 2);
  expect_one_line(outcome.err);
  EXPECT_THAT(outcome.err, HasSubstr("--width must be even"));
  EXPECT_FALSE(fs::exists(dir_ / "made"));
}

TEST_F(CommandLine, NamesACommandThatItDoesNotKnow) {
  EXPECT_THAT(run("chek a.toml").err, HasSubstr("chek"));
  EXPECT_THAT(run("calibrate lenz -o a.toml").err, HasSubstr("\"calibrate lenz\""));
}

TEST_F(CommandLine, PutsNoFiguresInThePlaceOfWhatIsNone) {
  const std::string lens = write("scene.toml", "model = \"pinhole\"\n");
  const Outcome refused = run("devices --json " + lens);
  EXPECT_EQ(refused.status, 1);
  expect_one_line(refused.err);
  EXPECT_THAT(refused.err, HasSubstr("is no JSON"));
  EXPECT_EQ(content_of(lens), "model = \"pinhole\"\n");
  const std::string figures = write("devices.json", "\n[1]");
  EXPECT_EQ(run("devices --json " + figures).status, 0);
  EXPECT_NE(content_of(figures), "\n[1]");
  EXPECT_EQ(run("devices --json " + (dir_ / "no" / "a.json").string()).status, 1);
}

// A log on a full disk ends nothing by itself.
TEST_F(CommandLine, SaysByItsStatusThatItsWordsWereLost) {
  const char* binary = std::getenv("PLATELIGHT_BINARY");
  ASSERT_NE(binary, nullptr);
  const auto status_of = [&](const std::string& where) {
    const std::string figures = (dir_ / "a.json").string();
    const int status =
        std::system((std::string(binary) + " devices --json " + figures + where).c_str());
    EXPECT_FALSE(content_of(figures).empty()) << where;
    fs::remove(figures);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  EXPECT_EQ(status_of(" >/dev/full 2>/dev/null"), 1);
  EXPECT_EQ(status_of(" >/dev/full 2>/dev/full"), 1);
  EXPECT_EQ(status_of(" >/dev/null 2>/dev/full"), 0);
}

TEST_F(CommandLine, MeasuresNoChartThatItCannotWrite) {
  const std::string file = write("charts", "");
  const Outcome refused = run("chart lights hdr --out " + file + "/charts");
  EXPECT_EQ(refused.status, 1);
  expect_one_line(refused.err);
  EXPECT_THAT(refused.err, HasSubstr("charts"));
}

TEST_F(CommandLine, MakesNoFolderForTheChartOfASetThatIsNone) {
  const Outcome refused = run("chart set " + (dir_ / "absent" / "a.toml").string());
  EXPECT_EQ(refused.status, 1);
  expect_one_line(refused.err);
  EXPECT_FALSE(fs::exists(dir_ / "absent"));
}

TEST_F(CommandLine, RefusesABenchmarkWithoutItsSubject) {
  for (const char* words : {"bench wheels", "bench inputs", "bench cycles"}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.status, 2) << words;
    expect_one_line(outcome.err);
  }
}

TEST_F(CommandLine, RefusesWhatAChartOrABenchmarkWouldNotLookAt) {
  for (const auto& [words, possible] :
       {std::pair{"chart hdr --quick --set /nonexistent.toml", "photograph"},
        {"chart photograph hdr --quick --set /nonexistent.toml", "photograph"},
        {"chart set a.toml --set b.toml", "photograph"},
        {"chart all lights --quick", "all stands alone"},
        {"chart hdr --quick --samples 7", "chart set"},
        {"bench drag --scene nosuch", "headlight, glass_sphere, tv_room, car"},
        {"bench drag --scene billboards", "headlight, glass_sphere, tv_room, car"},
        {"bench kernel --scene car", "papers, drag, cycles"},
        {"bench growth --pictures here", "papers, drag, cycles"},
        {"bench kernel --set a.toml", "inputs"},
        {"bench hdr --model a.obj", "load"},
        {"bench kernel --width 64", "papers"},
        {"bench cycles --pictures here --height 64", "papers"},
        {"bench papers --frames 2", "inputs"},
        {"bench growth --check-error 1", "papers, cycles"},
        {"bench papers --converged 2", "cycles"},
        {"bench drag --runs 1", "kernel, growth, papers, deform, cycles, inputs, hdr, load"}}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.status, 2) << words;
    expect_one_line(outcome.err);
    EXPECT_THAT(outcome.err, HasSubstr(possible)) << words;
    EXPECT_EQ(outcome.out, "") << words;
  }
}

TEST_F(CommandLine, ReturnsOneAndOneLineForAFileThatIsNotThere) {
  const Outcome outcome = run("check " + (dir_ / "absent.toml").string());
  EXPECT_EQ(outcome.status, 1);
  expect_one_line(outcome.err);
  EXPECT_THAT(outcome.err, HasSubstr("absent.toml"));
}

TEST_F(CommandLine, RecordsLiveCamerasOnly) {
  write_made_set(dir_, "grey:3,25,0");
  const std::string take = (dir_ / "take").string();
  const Outcome file = run("capture record " + (dir_ / "sky.exr").string() + " " + take);
  EXPECT_EQ(file.status, 1);
  EXPECT_THAT(file.err, HasSubstr("it is no live camera"));
  EXPECT_FALSE(fs::exists(take));
  const Outcome none = run("capture record v4l2:/dev/none " + take);
  EXPECT_EQ(none.status, 1);
  EXPECT_THAT(none.err, HasSubstr("cannot open v4l2:/dev/none"));
  EXPECT_EQ(run("capture play v4l2:/dev/none " + take).status, 2);
}

TEST_F(CheckedSets, ReturnOneWhenTheFiguresCannotBeWritten) {
  const Outcome outcome =
      run("check " + write_good() + " --json " + (dir_ / "no/such/dir.json").string());
  EXPECT_EQ(outcome.status, 1);
  expect_one_line(outcome.err);
}

TEST_F(CheckedSets, AreGood) {
  const std::string set = write_good();
  const Outcome outcome = run("check " + set);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr(set + ": good"));
  EXPECT_EQ(outcome.err, "");
}

TEST_F(CheckedSets, SayNothingWhenQuiet) {
  const Outcome outcome = run("check --quiet " + write_good());
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.out + outcome.err, "");
}

TEST_F(CommandLine, NamesAllFaultsOfASetAndWritesThemAsFigures) {
  const std::string set = write("a.toml", "[show]\nwidth = 0\nheight = nan\n");
  const std::string json = (dir_ / "figures.json").string();
  const Outcome outcome = run("check " + set + " --json " + json);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.err, HasSubstr(set + ":2:9: show.width"));
  EXPECT_THAT(outcome.err, HasSubstr(set + ":3:10: show.height"));
  EXPECT_THAT(outcome.err, HasSubstr("camera is missing"));
  EXPECT_THAT(content_of(json), HasSubstr("\"line\": 2"));
  EXPECT_THAT(content_of(json), HasSubstr("\"column\": 10"));
}

TEST_F(CheckedSets, AreCheckedWithTheirModels) {
  const std::string more = std::string(
      "lens = { model = \"pinhole\", focal_px = 60 }\n"
      "pose = { position = [0, -6, 1], look_at = [0, 0, 0] }\n"
      "[[object]]\nname = \"sign\"\nmesh = \"sign.obj\"\n");
  write("sign.obj", "mtllib lost.mtl\no board\nv 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n");
  const std::string json = (dir_ / "figures.json").string();
  const Outcome good = run("check " + write_good(more) + " --json " + json);
  EXPECT_EQ(good.status, 0) << good.err;
  EXPECT_THAT(good.out, HasSubstr("sign: " + (dir_ / "sign.obj").string()));
  EXPECT_THAT(good.out, HasSubstr("1 triangles, 3 vertices"));
  EXPECT_THAT(good.out, HasSubstr("z 0 to 2 m"));
  EXPECT_THAT(good.out, HasSubstr("parts: board"));
  EXPECT_THAT(good.out, HasSubstr("note: 'lost.mtl' is not there"));
  const auto figures = nlohmann::json::parse(content_of(json));
  EXPECT_EQ(figures["models"][0]["triangles"], 1);
  write("sign.obj", "v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 33\n");
  const Outcome bad = run("check " + (dir_ / "a.toml").string());
  EXPECT_EQ(bad.status, 1);
  EXPECT_THAT(bad.err, HasSubstr("a.toml:10:8: " + (dir_ / "sign.obj").string()));
}

// Shots of a sensor of 8 bits, to files; their paths, space-separated.
std::string write_shots(const std::filesystem::path& directory,
                        const capture::MadeSensor& sensor,
                        const std::vector<double>& exposures_s) {
  capture::Image scene = capture::make_image(192, 192);
  for (int y = 0; y < scene.height; ++y) {
    for (int x = 0; x < scene.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        const int patch = (y / 16 * 12 + x / 16 + 5 * c) % 17;
        scene.at(y, x, c) = static_cast<float>(std::exp2(-patch / 2.0) * (1 + 0.1 * (x % 16) / 16));
      }
    }
  }
  std::string paths;
  for (std::size_t i = 0; i < exposures_s.size(); ++i) {
    const capture::MadeShot shot = capture::expose(sensor, scene, exposures_s[i], i);
    const std::filesystem::path path = directory / ("shot" + std::to_string(i) + ".png");
    const std::vector<std::uint8_t> codes(shot.codes.begin(), shot.codes.end());
    capture::write_png(path, shot.width, shot.height, 3, codes);
    paths += path.string() + " ";
  }
  return paths;
}

TEST_F(CommandLine, MergesShotsOfStatedExposures) {
  const capture::MadeSensor sensor{
      .full_well_e = 40'000, .read_noise_e = 4, .bits = 8, .transfer = capture::Transfer::srgb};
  const std::string shots = write_shots(dir_, sensor, {0.02, 0.1, 0.5});
  const std::string out = (dir_ / "light.exr").string();
  const std::string json = (dir_ / "light.json").string();
  const std::string command =
      "hdr " + shots + "-o " + out + " --response sRGB --json " + json + " --exposures ";
  const Outcome outcome = run(command + "1/50,0.1,1/2");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto figures = nlohmann::json::parse(content_of(json));
  EXPECT_EQ(figures["exposures_s"].get<std::vector<double>>(),
            (std::vector<double>{1.0 / 50, 0.1, 0.5}));
  EXPECT_NEAR(capture::read_exr(out).at(8, 8, 0), 1.05, 0.05) << "light of the brightest patch";

  const Outcome fewer = run(command + "1/50,0.1");
  EXPECT_EQ(fewer.status, 2);
  EXPECT_THAT(fewer.err, HasSubstr("2 times for 3 shots"));
  expect_one_line(fewer.err);
  for (const char* wrong : {"soon,1,2", "0,1,2", "1/0,1,2", "1,,2"}) {
    EXPECT_EQ(run(command + wrong).status, 2) << wrong;
  }
}

TEST_F(CommandLine, CalibratesALinearSensorFromItsShots) {
  const capture::MadeSensor sensor{
      .full_well_e = 4000, .read_noise_e = 20, .bits = 8, .pedestal = 12};
  const std::string shots = write_shots(dir_, sensor, {0.1, 0.1, 0.4, 0.4, 1.5, 1.5});
  const std::string out = (dir_ / "camera.toml").string();
  const std::string json = (dir_ / "response.json").string();
  const std::string command = "calibrate response " + shots + "-o " + out + " --json " + json;
  const Outcome outcome = run(command + " --exposures 0.1,1/10,0.4,0.4,1.5,3/2");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("electrons per code"));
  const auto figures = nlohmann::json::parse(content_of(json));
  EXPECT_EQ(figures["model"], "linear");
  EXPECT_NEAR(figures["black"][0]["value"], 12, 0.5);
  EXPECT_NEAR(figures["gain"][1]["value"], 4000.0 / 243, 2);
  EXPECT_NEAR(figures["read_noise_e"][2]["value"], 20, 3);
  for (const char* key : {"parameters", "saturation", "noise", "warnings", "time_ms"}) {
    EXPECT_TRUE(figures.contains(key)) << key;
  }
  EXPECT_TRUE(capture::read_response(out).linear);

  EXPECT_EQ(run(command + " --exposures 0.1,0.4").status, 2);
  EXPECT_EQ(run(command + " --exposures soon").status, 2);
  EXPECT_EQ(run(command + " --exposures 0.1,0.1,0.4,0.4,1.5,1e-44").status, 2);
  EXPECT_EQ(run("calibrate response " + shots + "-o a.txt").status, 2);
  const Outcome untold = run(command);  // PNG files tell no exposures
  EXPECT_EQ(untold.status, 1);
  expect_one_line(untold.err);
  const Outcome equal = run(command + " --exposures 1,1,1,1,1,1");
  EXPECT_EQ(equal.status, 1);
  EXPECT_THAT(equal.err, HasSubstr("all shots have one exposure"));
  EXPECT_EQ(run("calibrate response replay:" + (dir_ / "absent").string() + " -o " + out).status,
            1);
}

TEST_F(CommandLine, CalibratesACurveWithItsCandidates) {
  const capture::MadeSensor sensor{
      .full_well_e = 40'000, .read_noise_e = 4, .bits = 8, .transfer = capture::Transfer::srgb};
  const std::string shots = write_shots(dir_, sensor, {0.02, 0.1, 0.1, 0.5, 2});
  const std::string out = (dir_ / "camera.toml").string();
  const std::string json = (dir_ / "response.json").string();
  const Outcome outcome = run("calibrate response " + shots + "-o " + out + " --json " + json +
                              " --exposures 0.02,0.1,0.1,0.5,2");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto figures = nlohmann::json::parse(content_of(json));
  EXPECT_EQ(figures["model"], "sRGB");
  EXPECT_GT(figures["candidates"].size(), 6U);
  EXPECT_LT(figures["pixel_error"], 0.03);
  EXPECT_LT(figures["heldout_error"], 0.04);
  EXPECT_EQ(capture::read_response(out).curve.name, "sRGB");
}

TEST_F(CommandLine, CalibratesVignettingFromAnEvenField) {
  const std::string lens =
      write("lens.toml",
            "model = \"equisolid\"\nwidth = 100\nheight = 100\nf = 35\ncx = 49.5\ncy = 49.5\n"
            "max_angle = 85\n");
  capture::Image field = capture::make_image(100, 100);
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 100; ++x) {
      const double angle = 2 * std::asin(std::min(1.0, std::hypot(x - 49.5, y - 49.5) / 70));
      const double light = 0.4 * (1 - 0.2 * angle * angle) + 0.004 * ((x * 7 + y * 13) % 5 - 2);
      for (int c = 0; c < 3; ++c) field.at(y, x, c) = static_cast<float>(light);
    }
  }
  const std::string even = (dir_ / "even.exr").string();
  capture::write_exr(even, field);
  const std::string json = (dir_ / "vignetting.json").string();
  const std::string command = "calibrate vignetting " + even + " --lens " + lens;
  const Outcome outcome = run(command + " --json " + json);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("vignetting = ["));
  const auto figures = nlohmann::json::parse(content_of(json));
  ASSERT_GE(figures["vignetting"].size(), 1U);
  EXPECT_NEAR(figures["vignetting"][0], -0.2, 0.01);
  EXPECT_EQ(figures["candidates"].size(), 5U);

  // A field of patches as bright as they please tells none.
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 100; ++x) {
      const float light = 0.1F + 0.1F * static_cast<float>((x / 4 * 7 + y / 4 * 13) % 6);
      for (int c = 0; c < 3; ++c) field.at(y, x, c) = light;
    }
  }
  const std::string patches = (dir_ / "patches.exr").string();
  capture::write_exr(patches, field);
  const Outcome none =
      run("calibrate vignetting " + patches + " --lens " + lens + " --json " + json);
  EXPECT_EQ(none.status, 1) << none.out;
  EXPECT_THAT(none.err, HasSubstr("vignetting is not told"));
  EXPECT_TRUE(nlohmann::json::parse(content_of(json))["vignetting"].is_null());

  EXPECT_EQ(run(command + " --poses a.cameramodel").status, 2);
  const std::string small =
      write("small.toml",
            "model = \"equisolid\"\nwidth = 50\nheight = 50\nf = 35\ncx = 24.5\n"
            "cy = 24.5\n");
  const Outcome other = run("calibrate vignetting " + even + " --lens " + small);
  EXPECT_EQ(other.status, 1);
  EXPECT_THAT(other.err, HasSubstr("100x100"));
  expect_one_line(other.err);
}

TEST_F(CommandLine, DrawsABoard) {
  const std::string out = (dir_ / "board.pdf").string();
  const std::string json = (dir_ / "board.json").string();
  const std::string board = "calibrate board --board 10x7 --square 0.025 ";
  const Outcome outcome = run(board + "--charuco --marker 0.018 --dictionary DICT_4X4_50 --pdf " +
                              out + " --json " + json);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("10x7 inner corners, squares of 25 mm, markers of 18 mm"));
  EXPECT_THAT(content_of(out), testing::StartsWith("%PDF-1.4"));
  const auto figures = nlohmann::json::parse(content_of(json));
  EXPECT_EQ(figures["kind"], "charuco");
  EXPECT_EQ(figures["columns"], 10);
  EXPECT_EQ(figures["paper_mm"][0], 297);
  const std::string svg = (dir_ / "board.svg").string();
  EXPECT_THAT(outcome.err, HasSubstr("--paper A3"));
  const Outcome wide = run(board + "--paper 400x300 -o " + svg);
  EXPECT_EQ(wide.status, 0);
  EXPECT_EQ(wide.err, "");
  EXPECT_THAT(content_of(svg), HasSubstr("width=\"400mm\""));

  const Outcome large = run("calibrate board --board 10x7 --square 0.04 -o " + out);
  EXPECT_EQ(large.status, 1);
  EXPECT_THAT(large.err, HasSubstr("it needs A2"));
  expect_one_line(large.err);
  for (const char* words :
       {"", "-o a.txt", "--pdf a --out a.svg", "--board 10 --pdf a", "--board 2x2 --pdf a",
        "--board 10x7x --pdf a", "--board -3x5 --pdf a", "--marker 0.01 --pdf a",
        "--paper A9 --pdf a", "--charuco --dictionary DICT_1 --pdf a",
        "--charuco --marker 0.03 --pdf a",
        "--charuco --dictionary DICT_4X4_50 --board 40x30 --square 0.01 --paper A2 --pdf a"}) {
    const Outcome wrong = run(board.substr(0, 15) + " " + words);
    EXPECT_EQ(wrong.status, 2) << words;
    expect_one_line(wrong.err);
  }
}

}  // namespace
}  // namespace studio::command_line_test
