// What check finds of a set before it runs: faults, and what will be missed on air.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "capture/png.h"
#include "tests/studio/runs.h"

namespace studio::checked_runs_test {
namespace {

using testing::HasSubstr;
using testing::Not;

using CheckedRuns = Runs;

TEST_F(CheckedRuns, AreCheckedUpToTheirDisplayAndTake) {
  const auto faults_of = [&](const std::string& more,
                             const std::string& source = "file:plate_%d.png") {
    write_set();
    return run("check " + write_made_set(dir_, source, more)).err;
  };
  EXPECT_EQ(faults_of(""), "");
  EXPECT_THAT(faults_of("[display]\ndisplay = \"none such\"\n"), HasSubstr("none such"));
  EXPECT_THAT(faults_of("[record]\nfile = \"no/folder/take.mkv\"\n"), HasSubstr("take.mkv"));
  EXPECT_FALSE(fs::exists(dir_ / "no"));
  EXPECT_THAT(faults_of("[record]\nexr = \"cube.obj/take\"\n"), HasSubstr("cube.obj"));
  EXPECT_EQ(faults_of("[record]\nexr = \"no/folder/yet\"\n"), "");
  EXPECT_FALSE(fs::exists(dir_ / "no"));
  EXPECT_THAT(faults_of("[record]\nfile = \"t.mkv\"\ntimecode = \"hello\"\n"), HasSubstr("hello"));
  EXPECT_THAT(faults_of("[record]\nfile = \"t.mkv\"\ntimecode = \"25:00:00:00\"\n"),
              HasSubstr("25:00:00:00"));
  EXPECT_FALSE(fs::exists(dir_ / "t.mkv"));
  const std::vector<std::uint8_t> large(66 * 48 * 3, 120);
  capture::write_png(dir_ / "large.png", 66, 48, 3, large);
  EXPECT_THAT(faults_of("", "file:large.png"), HasSubstr("66x48"));
  EXPECT_THAT(faults_of("[[video]]\nsource = \"file:large.png\"\nobject = \"kube\"\n"),
              HasSubstr("is shown nowhere"));
}

TEST_F(CheckedRuns, AreToldOfPicturesThatAreMissing) {
  const std::string set = write_set();
  EXPECT_THAT(run("check " + set).out, Not(HasSubstr("note:")));
  fs::copy(dir_ / "plate_0.png", dir_ / "plate_15.png");
  const std::string json = (dir_ / "check.json").string();
  const Outcome outcome = run("check " + set + " --json " + json);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(
      outcome.out,
      HasSubstr("plate_%d.png: there is no file with the numbers 3 to 14: those frames are lost"));
  EXPECT_EQ(nlohmann::json::parse(content_of(json))["notes"].size(), 1U);
}

TEST_F(CheckedRuns, AreToldOfObjectsThatNothingLights) {
  const auto with = [&](const std::string& more) {
    write_set();
    return write("dark.toml",
                 "[show]\nwidth = 64\nheight = 48\n"
                 "[camera]\nsource = \"plate_%d.png\"\nmodel = \"pinhole\"\nfocal_px = 60\n"
                 "pose = { position = [0, -8, 4], look_at = [0, 0, 0.5] }\n" +
                     more);
  };
  const std::string car = "[[object]]\nmade = \"car\"\n";
  const std::string lamp = "[[lamp]]\nposition = [0, 0, 5]\nintensity = 100\n";
  EXPECT_THAT(run("check " + with(car)).out, HasSubstr("note: nothing lights the objects"));
  EXPECT_THAT(run("check " + with(car + lamp)).out, Not(HasSubstr("nothing lights")));
  EXPECT_THAT(run("check " + with("")).out, Not(HasSubstr("nothing lights")));
}

// Exposures that are the wrong way round.
TEST_F(CheckedRuns, AreToldOfAProbeWhoseShotsContradictEachOther) {
  const std::vector<std::uint8_t> dark(32 * 16 * 3, 60), bright(32 * 16 * 3, 200);
  capture::write_png(dir_ / "dark.png", 32, 16, 3, dark);
  capture::write_png(dir_ / "bright.png", 32, 16, 3, bright);
  const auto with = [&](const std::string& exposures) {
    write_set();
    return write("probe.toml",
                 "[show]\nwidth = 64\nheight = 48\n"
                 "[camera]\nsource = \"plate_%d.png\"\nmodel = \"pinhole\"\nfocal_px = 60\n"
                 "pose = { position = [0, -8, 4], look_at = [0, 0, 0.5] }\n"
                 "[probe]\nsource = [\"dark.png\", \"bright.png\"]\nexposures = [" +
                     exposures + "]\nlens = \"latlong\"\nmatch = [1, 1, 1]\n");
  };
  EXPECT_THAT(run("check " + with("0.01, 0.13")).out, Not(HasSubstr("contradict")));
  const std::string set = with("0.13, 0.01"), json = (dir_ / "run.json").string();
  EXPECT_THAT(run("check " + set).out, HasSubstr("note: the probe: in 100 % of the pixels"));
  const Outcome outcome = run("run " + set + " --frames 1 --json " + json);
  EXPECT_EQ(outcome.status, 0);
  EXPECT_THAT(outcome.err, HasSubstr("the shots contradict each other"));
  EXPECT_EQ(nlohmann::json::parse(content_of(json))["probe"]["inconsistent"], 1);
}

TEST_F(CheckedRuns, AreCheckedForTheFaultsOfAllSources) {
  write("plate.png", "\x89PNG\r\n\x1a\nnothing");
  write("light.hdr", "no light");
  write("video.png", "no video");
  write("person.png", "no person");
  const std::string set = write("bad.toml",
                                "[show]\nwidth = 64\nheight = 48\n"
                                "[camera]\nsource = \"plate.png\"\n"
                                "model = \"pinhole\"\nfocal_px = 60\n"
                                "pose = { position = [0, -8, 4], look_at = [0, 0, 0.5] }\n"
                                "[probe]\nsource = \"light.hdr\"\n"
                                "[display]\ndisplay = \"none such\"\n"
                                "[[object]]\nname = \"tv\"\nmade = \"tv\"\n"
                                "[[video]]\nobject = \"tv/tv\"\nsource = \"video.png\"\n"
                                "[[billboard]]\nsource = \"person.png\"\nheight = 2\n"
                                "position = [0, 0, 0]\n");
  const Outcome outcome = run("check " + set);
  EXPECT_EQ(outcome.status, 1);
  for (const char* place : {":5:10: ", ":10:10: ", ":11:1: ", ":18:10: ", ":20:10: "}) {
    EXPECT_THAT(outcome.err, HasSubstr(set + place)) << place;
  }
}

}  // namespace
}  // namespace studio::checked_runs_test
