// The source tree itself: what may include what, and what lies where.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace studio::layering_test {
namespace {

namespace fs = std::filesystem;

// Left to right: each may include itself and what is to its left.
constexpr std::array<std::string_view, 5> folders{"capture", "calibrate", "render", "compositing",
                                                  "studio"};

std::size_t rank_of(std::string_view folder) {
  return static_cast<std::size_t>(std::ranges::find(folders, folder) - folders.begin());
}

// The folder that an include line names: nothing for other lines, and for headers of others.
std::string_view included_folder(std::string_view line) {
  const std::size_t quote = line.find('"');
  if (!line.starts_with("#include") || quote == std::string_view::npos) return {};
  const std::string_view path = line.substr(quote + 1);
  const std::string_view folder = path.substr(0, path.find('/'));
  return rank_of(folder) < folders.size() ? folder : std::string_view{};
}

std::vector<fs::path> sources_of(std::string_view folder) {
  std::vector<fs::path> sources;
  for (const auto& entry :
       fs::recursive_directory_iterator(fs::path(PLATELIGHT_SOURCE_DIR) / folder)) {
    const std::string ending = entry.path().extension().string();
    if (ending == ".h" || ending == ".cpp") sources.push_back(entry.path());
  }
  return sources;
}

// What a command prints, by lines.
std::vector<std::string> lines_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::vector<std::string> lines;
  std::array<char, 4096> buffer{};
  while (pipe &&
         std::fgets(buffer.data(), static_cast<int>(buffer.size()), pipe.get()) != nullptr) {
    std::string line = buffer.data();
    if (line.ends_with('\n')) line.pop_back();
    lines.push_back(std::move(line));
  }
  return lines;
}

TEST(IncludedFolder, NamesOursOnly) {
  EXPECT_EQ(included_folder("#include \"render/scene.h\""), "render");
  EXPECT_EQ(included_folder("#include <vector>"), "");
  EXPECT_EQ(included_folder("#include \"other/scene.h\""), "");
}

TEST(Layering, IncludesGoOneWay) {
  std::size_t includes = 0;
  for (const std::string_view folder : folders) {
    for (const fs::path& source : sources_of(folder)) {
      std::ifstream file(source);
      int number = 0;
      for (std::string line; std::getline(file, line);) {
        ++number;
        const std::string_view included = included_folder(line);
        if (included.empty()) continue;
        ++includes;
        EXPECT_LE(rank_of(included), rank_of(folder)) << source.string() << ":" << number << ": "
                                                      << folder << " may not include " << included;
      }
    }
  }
  EXPECT_GT(includes, 20U) << "the tree was not found";
}

TEST(Layering, LinksGoOneWay) {
  for (const std::string_view folder : folders) {
    std::ifstream file(fs::path(PLATELIGHT_SOURCE_DIR) / folder / "CMakeLists.txt");
    ASSERT_TRUE(file) << folder;
    bool linking = false;
    for (std::string line; std::getline(file, line);) {
      linking = linking || line.starts_with("target_link_libraries(" + std::string(folder));
      if (!linking) continue;
      for (const std::string_view other : folders) {
        std::istringstream words(line);
        const bool named = std::find(std::istream_iterator<std::string>(words), {}, other) !=
                           std::istream_iterator<std::string>();
        EXPECT_FALSE(named && rank_of(other) > rank_of(folder)) << folder << ": " << line;
      }
      linking = line.find(')') == std::string::npos;
    }
  }
}

TEST(Tree, HasNothingAtTheTopThatDoesNotBelongThere) {
  const std::set<std::string> allowed{
      ".ci",       ".clang-format", ".gitignore",  "CMakeLists.txt", "LICENSE", "README.md",
      "calibrate", "capture",       "compositing", "render",         "studio",  "tests"};
  const auto files = lines_of("git -C " PLATELIGHT_SOURCE_DIR " ls-files");
  if (files.empty()) GTEST_SKIP() << "not a git checkout";
  for (const std::string& path : files) {
    EXPECT_TRUE(allowed.contains(path.substr(0, path.find('/')))) << path;
  }
}

TEST(Tree, SaysInTheFirstLineOfEveryFileWhatItIs) {
  for (const std::string_view folder : folders) {
    for (const fs::path& source : sources_of(folder)) {
      std::ifstream file(source);
      std::string first;
      std::getline(file, first);
      EXPECT_TRUE(first.starts_with("// ")) << source.string();
    }
  }
}

// So that it compiles alone.
TEST(Tree, IncludesEachHeaderFirstInItsOwnSource) {
  std::size_t headers = 0;
  for (const std::string_view folder : folders) {
    for (const fs::path& header : sources_of(folder)) {
      if (header.extension() != ".h") continue;
      ++headers;
      std::ifstream file(header);
      std::string line;
      while (std::getline(file, line) && line.starts_with("//")) {
      }
      EXPECT_EQ(line, "#pragma once") << header.string();
      std::ifstream source(fs::path(header).replace_extension(".cpp"));
      if (!source) continue;  // tests/CMakeLists.txt compiles it
      while (std::getline(source, line) && !line.starts_with("#include")) {
      }
      EXPECT_EQ(line,
                "#include \"" + header.lexically_relative(PLATELIGHT_SOURCE_DIR).string() + "\"")
          << header.string();
    }
  }
  EXPECT_GT(headers, 20U) << "the tree was not found";
}

// Other versions break lines at other places.
TEST(Tree, IsFormattedByItsOwnRules) {
  const auto version = lines_of("clang-format --version 2>&1");
  if (version.empty() || version[0].find("version 14.") == std::string::npos) {
    GTEST_SKIP() << "clang-format 14 is not installed";
  }
  const auto faults = lines_of("cd " PLATELIGHT_SOURCE_DIR
                               " && find capture calibrate render compositing studio tests"
                               " \\( -name '*.h' -o -name '*.cpp' -o -name '*.inc' \\) -print0"
                               " | xargs -0 clang-format --dry-run -Werror 2>&1"
                               " | grep -E '(warning|error):'");
  EXPECT_EQ(faults, std::vector<std::string>{}) << "clang-format -i mends it";
}

TEST(Tree, HasScriptsThatShellsCanReadAndRun) {
  const auto scripts = lines_of("git -C " PLATELIGHT_SOURCE_DIR " ls-files -- '*.sh' .ci/run");
  if (scripts.empty()) GTEST_SKIP() << "not a git checkout";
  for (const std::string& script : scripts) {
    const fs::path path = fs::path(PLATELIGHT_SOURCE_DIR) / script;
    EXPECT_EQ(lines_of("bash -n " + path.string() + " 2>&1"), std::vector<std::string>{}) << script;
    EXPECT_NE(fs::status(path).permissions() & fs::perms::owner_exec, fs::perms::none) << script;
  }
}

}  // namespace
}  // namespace studio::layering_test
