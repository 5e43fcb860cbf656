// Set files, watched.
#include "studio/set_watch.h"

#include <chrono>
#include <exception>
#include <system_error>
#include <utility>

namespace studio {

using namespace std::chrono_literals;

SetWatch::SetWatch(std::string path,
                   std::filesystem::file_time_type since,
                   std::function<void(Set)> changed,
                   std::function<void(const SetError&)> refused)
    : path_(std::move(path)),
      changed_(std::move(changed)),
      refused_(std::move(refused)),
      seen_(since),
      thread_([this](const std::stop_token& stop) { watch(stop); }) {}

void SetWatch::watch(const std::stop_token& stop) const {
  constexpr auto patience = 3s;
  std::filesystem::file_time_type seen = seen_;
  auto there_at = std::chrono::steady_clock::now();
  bool told_gone = false;
  while (!stop.stop_requested()) {
    std::this_thread::sleep_for(250ms);
    std::error_code error;  // editors replace a file: for a moment there is none
    const auto now = std::filesystem::last_write_time(path_, error);
    if (error) {
      const bool is_gone = std::chrono::steady_clock::now() - there_at > patience;
      if (is_gone && !std::exchange(told_gone, true))
        refused_(SetError({{path_, 0, 0, "is not there: the show goes on without its edits"}}));
      continue;
    }
    there_at = std::chrono::steady_clock::now();
    told_gone = false;
    if (now == seen) continue;
    seen = now;
    try {
      changed_(read_set(path_));
    } catch (const SetError& fault) {
      refused_(fault);
    } catch (const std::exception& error) {  // of the machine: no memory, say
      refused_(SetError({{path_, 0, 0, error.what()}}));
    }
  }
}

}  // namespace studio
