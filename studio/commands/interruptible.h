// Commands that Ctrl-C ends as if their work were done.
#pragma once

#include <array>
#include <atomic>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <ctime>

namespace studio {

// Until it goes out of scope, a first Ctrl-C, SIGTERM or SIGHUP (the terminal is gone) is only
// noted; the next one, of whatever kind, ends the program, unless it comes within a quarter of a
// second: some send theirs to a program and to its group, and a terminal that goes sends several.
// What the program was told to ignore stays so. One at a time.
class Interruptible {
 public:
  Interruptible() {
    first_ns_ = 0;
    for (std::size_t i = 0; i < signals.size(); ++i) {
      before_[i] = std::signal(signals[i], &Interruptible::note);
      if (before_[i] == SIG_IGN) std::signal(signals[i], SIG_IGN);
    }
  }
  ~Interruptible() {
    for (std::size_t i = 0; i < signals.size(); ++i) std::signal(signals[i], before_[i]);
  }
  Interruptible(const Interruptible&) = delete;
  Interruptible& operator=(const Interruptible&) = delete;

  bool is_interrupted() const { return first_ns_ != 0; }

 private:
  static constexpr std::array signals{SIGINT, SIGTERM, SIGHUP};
  static constexpr std::int64_t together_ns = 250'000'000;

  static std::int64_t now_ns() {
    std::timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
  }

  static void note(int signal) {
    const std::int64_t now = now_ns();
    std::int64_t first = 0;
    if (first_ns_.compare_exchange_strong(first, now) || now - first < together_ns) return;
    std::signal(signal, SIG_DFL);
    std::raise(signal);
  }

  static inline std::atomic<std::int64_t> first_ns_ = 0;  // on the monotonic clock; 0 = none yet
  static_assert(std::atomic<std::int64_t>::is_always_lock_free, "signal handlers use it");
  std::array<void (*)(int), signals.size()> before_{};
};

}  // namespace studio
