// Whole files.
#include "capture/files.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <stdexcept>

#include "tests/made_files.h"

namespace capture::files_test {
namespace {

TEST(WriteFile, IsReadBackAndLeavesNothingBeside) {
  const auto directory = made::make_temporary_directory();
  const std::vector<std::byte> bytes{std::byte{1}, std::byte{0}, std::byte{255}};
  write_file(directory / "a", bytes);
  EXPECT_EQ(read_file(directory / "a"), bytes);
  const auto first = std::filesystem::directory_iterator(directory);
  EXPECT_EQ(std::distance(first, {}), 1);
}

TEST(WriteFile, NamesThePathThatCannotBeWritten) {
  const std::string path = made::make_temporary_directory() / "missing" / "a";
  try {
    write_file(path, {});
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find(path), std::string::npos);
  }
}

TEST(ReadFile, RefusesDirectoriesMissingAndLargeFiles) {
  const auto directory = made::make_temporary_directory();
  EXPECT_THROW(read_file(directory), std::runtime_error);
  EXPECT_THROW(read_file(directory / "missing"), std::runtime_error);
  write_file(directory / "a", std::vector<std::byte>(10));
  EXPECT_THROW(read_file(directory / "a", 9), std::runtime_error);
  EXPECT_EQ(read_file(directory / "a", 10).size(), 10U);
}

}  // namespace
}  // namespace capture::files_test
