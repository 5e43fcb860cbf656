// Commands that Ctrl-C ends as if their work were done.
#pragma once

#include <csignal>

namespace studio {

// Until it goes out of scope, a first Ctrl-C or SIGTERM is only noted; the next one ends the
// program. One at a time.
class Interruptible {
 public:
  Interruptible() {
    noted_ = 0;
    interrupt_ = std::signal(SIGINT, &Interruptible::note);
    terminate_ = std::signal(SIGTERM, &Interruptible::note);
  }
  ~Interruptible() {
    std::signal(SIGINT, interrupt_);
    std::signal(SIGTERM, terminate_);
  }
  Interruptible(const Interruptible&) = delete;
  Interruptible& operator=(const Interruptible&) = delete;

  bool is_interrupted() const { return noted_ != 0; }

 private:
  static void note(int signal) {
    noted_ = 1;
    std::signal(signal, SIG_DFL);
  }

  static inline volatile std::sig_atomic_t noted_ = 0;
  void (*interrupt_)(int);
  void (*terminate_)(int);
};

}  // namespace studio
