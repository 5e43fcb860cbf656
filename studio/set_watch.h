// Watches a set file while its show runs.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <thread>

#include "studio/set.h"

namespace studio {

// Looks at the file four times a second on a thread of its own, until destroyed. What it reads, or
// why it cannot, goes to the callbacks, on that thread.
class SetWatch {
 public:
  // `since`: when the file was last written, as far as its show knows.
  SetWatch(std::string path,
           std::filesystem::file_time_type since,
           std::function<void(Set)> changed,
           std::function<void(const SetError&)> refused);

 private:
  void watch(const std::stop_token& stop) const;

  std::string path_;
  std::function<void(Set)> changed_;
  std::function<void(const SetError&)> refused_;
  std::filesystem::file_time_type seen_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace studio
