// Commands that Ctrl-C ends as if their work were done.
#pragma once

#include <array>
#include <csignal>
#include <cstddef>

namespace studio {

// Until it goes out of scope, a first Ctrl-C, SIGTERM or SIGHUP (the terminal is gone) is only
// noted; the next one, of whatever kind, ends the program. What the program was told to ignore
// stays so. One at a time.
class Interruptible {
 public:
  Interruptible() {
    noted_ = 0;
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

  bool is_interrupted() const { return noted_ != 0; }

 private:
  static constexpr std::array signals{SIGINT, SIGTERM, SIGHUP};

  static void note(int) {
    noted_ = 1;
    for (const int signal : signals) {
      if (std::signal(signal, SIG_DFL) == SIG_IGN) std::signal(signal, SIG_IGN);
    }
  }

  static inline volatile std::sig_atomic_t noted_ = 0;
  std::array<void (*)(int), signals.size()> before_{};
};

}  // namespace studio
