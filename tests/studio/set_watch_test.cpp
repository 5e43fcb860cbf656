// Set files that are watched while they change, go and come back.
#include "studio/set_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/studio/made_show.h"

namespace studio::set_watch_test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

// What was told, from another thread.
class Told {
 public:
  void add(std::string words) {
    const std::lock_guard lock(mutex_);
    words_.push_back(std::move(words));
  }
  std::vector<std::string> wait_for(std::size_t count) const {
    for (int i = 0; i < 200; ++i) {
      {
        const std::lock_guard lock(mutex_);
        if (words_.size() >= count) return words_;
      }
      std::this_thread::sleep_for(50ms);
    }
    const std::lock_guard lock(mutex_);
    return words_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> words_;
};

TEST(SetWatch, TellsEditsAndOnceThatTheFileIsGone) {
  start();
  register_grey_camera();
  const auto directory = made::make_temporary_directory();
  const std::string path = write_made_set(directory, "grey:9,25,0");
  Told told;
  const SetWatch watch(
      path, std::filesystem::last_write_time(path), [&](const Set&) { told.add("changed"); },
      [&](const SetError& error) { told.add(error.what()); });
  std::filesystem::rename(path, path + ".old");
  const auto gone = HasSubstr("made.toml: is not there: the show goes on without its edits");
  EXPECT_THAT(told.wait_for(1), ElementsAre(gone));
  std::this_thread::sleep_for(1s);  // not again
  std::ofstream(path) << std::ifstream(path + ".old").rdbuf();
  EXPECT_THAT(told.wait_for(2), ElementsAre(gone, "changed"));
  std::ofstream(path) << "nonsense";
  EXPECT_THAT(told.wait_for(3), ElementsAre(gone, "changed", HasSubstr("made.toml:1:")));
}

}  // namespace
}  // namespace studio::set_watch_test
