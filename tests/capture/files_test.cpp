// Whole files.
#include "capture/files.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

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

TEST(WriteFile, ReplacesWhatALinkNamesAndWritesToDevices) {
  namespace fs = std::filesystem;
  const fs::path directory = made::make_temporary_directory();
  const std::vector<std::byte> bytes{std::byte{7}};
  write_file(directory / "a", {});
  fs::create_symlink(directory / "a", directory / "link");
  write_file(directory / "link", bytes);
  EXPECT_TRUE(fs::is_symlink(directory / "link"));
  EXPECT_EQ(read_file(directory / "a"), bytes);
  write_file("/dev/null", bytes);
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_THROW(write_file("/dev/full", bytes), std::runtime_error);
}

// What was there stays, and nothing half is left.
TEST(WriteFile, LeavesWhatWasThereWhereTheDiskIsFull) {
  const std::filesystem::path directory = made::make_temporary_directory();
  const std::vector<std::byte> before(10), after(100'000);
  write_file(directory / "a", before);
  struct rlimit all {};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &all), 0);
  auto* const handler = ::signal(SIGXFSZ, SIG_IGN);
  const struct rlimit little { 1000, all.rlim_max };
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &little), 0);
  EXPECT_THROW(write_file(directory / "a", after), std::runtime_error);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &all), 0);
  ::signal(SIGXFSZ, handler);
  EXPECT_EQ(read_file(directory / "a"), before);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(directory), {}), 1);
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
