// Files of the tests: the bad ones in tests/data/bad, temporary ones, and the real data.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <stdexcept>
#include <string>

namespace made {

// What is said of a file that crashes the helper which reads it. A sanitizer ends it in its way.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr const char* crashed_helper = "ended with status";
#else
inline constexpr const char* crashed_helper = "damaged";
#endif

inline std::filesystem::path bad_files() { return PLATELIGHT_SOURCE_DIR "/tests/data/bad"; }

inline std::filesystem::path real_data() {
  const char* place = std::getenv("PLATELIGHT_DATA");
  return place != nullptr ? place : PLATELIGHT_SOURCE_DIR "/../shared/data";
}

// A directory of the running test's own, empty.
inline std::filesystem::path make_temporary_directory() {
  const testing::TestInfo& test = *testing::UnitTest::GetInstance()->current_test_info();
  const std::filesystem::path directory =
      std::filesystem::path(testing::TempDir()) /
      (std::string("platelight_") + test.test_suite_name() + "_" + test.name());
  std::filesystem::remove_all(directory);
  std::filesystem::create_directories(directory);
  return directory;
}

// Expects `read` to refuse every file of tests/data/bad that begins and ends so, each with its path
// and the words that stand beside its name.
template <class Read>
void expect_refusals(const std::string& begin,
                     const std::string& end,
                     const std::map<std::string, std::string>& words,
                     const Read& read) {
  std::set<std::string> met;
  for (const auto& entry : std::filesystem::directory_iterator(bad_files())) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(begin) || !name.ends_with(end)) continue;
    ASSERT_TRUE(words.contains(name)) << name << " has no expectation";
    met.insert(name);
    try {
      read(entry.path().string());
      ADD_FAILURE() << name << " was accepted";
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(entry.path().string()), std::string::npos)
          << error.what();
      EXPECT_NE(std::string(error.what()).find(words.at(name)), std::string::npos) << error.what();
    }
  }
  for (const auto& [name, text] : words) EXPECT_TRUE(met.contains(name)) << name << " is missing";
}

}  // namespace made
