// What a show has no more use for goes beside its frames.
#pragma once

#include <algorithm>
#include <chrono>
#include <future>
#include <mutex>
#include <system_error>
#include <utility>
#include <vector>

namespace studio {

// Any thread may use it.
class Leaving {
 public:
  Leaving() = default;
  // Waits for all that goes.
  ~Leaving() = default;
  Leaving(const Leaving&) = delete;
  Leaving& operator=(const Leaving&) = delete;

  // Destroys it on a thread of its own: a device that stalls, or a file that is being read, may
  // take long to be let go.
  template <class Thing>
  void let_go(Thing thing) {
    const std::lock_guard lock(mutex_);
    std::erase_if(going_, has_gone);
    try {
      going_.push_back(std::async(std::launch::async, [before = std::move(thing)]() mutable {
        const Thing gone = std::move(before);
      }));
    } catch (const std::system_error&) {
      // No thread can be had: then the caller waits.
    }
  }

  // Waits until all that goes by now is gone, but not for longer than that. Whether anything went.
  bool wait(std::chrono::milliseconds patience) const {
    std::vector<std::shared_future<void>> going;
    {
      const std::lock_guard lock(mutex_);
      going = going_;
    }
    std::erase_if(going, has_gone);
    const auto end = std::chrono::steady_clock::now() + patience;
    for (const std::shared_future<void>& one : going) one.wait_until(end);
    return !going.empty();
  }

 private:
  static bool has_gone(const std::shared_future<void>& one) {
    return one.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  }

  mutable std::mutex mutex_;
  std::vector<std::shared_future<void>> going_;
};

}  // namespace studio
