// The program as its users and their scripts see it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "studio/command.h"

namespace studio {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

struct Outcome {
  int status = -1;
  std::string out;
  std::string err;
};

std::string content_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class CommandLine : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    dir_ = fs::path(testing::TempDir()) /
           (std::string("platelight_command_") + info->name() + std::to_string(getpid()));
    fs::create_directories(dir_);
  }
  void TearDown() override { fs::remove_all(dir_); }

  Outcome run(const std::string& words) const {
    const char* binary = std::getenv("PLATELIGHT_BINARY");
    EXPECT_NE(binary, nullptr) << "ctest sets PLATELIGHT_BINARY";
    const fs::path out = dir_ / "out.txt";
    const fs::path err = dir_ / "err.txt";
    const std::string line = std::string(binary) + " " + words + " >" + out.string() + " 2>" +
                             err.string() + " </dev/null";
    const int status = std::system(line.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content_of(out), content_of(err)};
  }

  std::string write(const std::string& name, const std::string& content) const {
    std::ofstream(dir_ / name) << content;
    return (dir_ / name).string();
  }

  fs::path dir_;
};

void expect_one_line(const std::string& text) {
  ASSERT_FALSE(text.empty());
  EXPECT_EQ(text.find('\n'), text.size() - 1) << text;
}

constexpr const char* good_set =
    "[show]\nwidth = 64\nheight = 48\n[camera]\nsource = \"made:grey\"\n";

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
    EXPECT_THAT(outcome.out, HasSubstr(std::string(command.summary)));
  }
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

TEST_F(CommandLine, NamesACommandThatItDoesNotKnow) {
  EXPECT_THAT(run("chek a.toml").err, HasSubstr("chek"));
}

TEST_F(CommandLine, ReturnsOneAndOneLineForAFileThatIsNotThere) {
  const Outcome outcome = run("check " + (dir_ / "absent.toml").string());
  EXPECT_EQ(outcome.status, 1);
  expect_one_line(outcome.err);
  EXPECT_THAT(outcome.err, HasSubstr("absent.toml"));
}

TEST_F(CommandLine, ReturnsOneWhenTheFiguresCannotBeWritten) {
  const Outcome outcome =
      run("check " + write("a.toml", good_set) + " --json " + (dir_ / "no/such/dir.json").string());
  EXPECT_EQ(outcome.status, 1);
  expect_one_line(outcome.err);
}

TEST_F(CommandLine, ChecksAGoodSet) {
  const std::string set = write("a.toml", good_set);
  const Outcome outcome = run("check " + set);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr(set + ": good"));
  EXPECT_EQ(outcome.err, "");
}

TEST_F(CommandLine, SaysNothingWhenQuiet) {
  const Outcome outcome = run("check --quiet " + write("a.toml", good_set));
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

}  // namespace
}  // namespace studio
