// Our own helper programs, run on untrusted input under limits.
#pragma once

#include <chrono>
#include <cstddef>
#include <span>
#include <stop_token>
#include <string>
#include <utility>

namespace capture {

struct SandboxLimits {
  std::size_t memory_bytes = std::size_t{1} << 30;  // address space
  std::chrono::seconds processor_time{30};
};

// Takes from the calling process, for good, what decoding does not need: memory and processor time
// beyond the limits, core files, privileges, and every system call but memory and the input and
// output that are open already. For the first line of a helper's main, before it looks at input.
// Throws std::runtime_error if the system refuses a limit; a kernel without seccomp is accepted.
void confine_this_process(const SandboxLimits& limits);

// Where a helper program is: in the folder of the environment's PLATELIGHT_HELPERS, or else beside
// this executable, in ../libexec/platelight, or in the build tree. Throws std::runtime_error naming
// the places if it is in none.
std::string helper_path(const std::string& name);

// A helper at work. Its standard input is a file of ours or what we write, its standard output a
// pipe to us; it inherits nothing else. Safe in a threaded process: the child runs no code of ours
// before exec.
class SandboxedChild {
 public:
  // Starts `program` on `input_fd` (which stays the caller's). Throws std::runtime_error if it does
  // not start.
  SandboxedChild(const std::string& program, int input_fd, std::chrono::milliseconds time_limit);
  // Starts `program` to be written to.
  SandboxedChild(const std::string& program, std::chrono::milliseconds time_limit);
  ~SandboxedChild();  // kills it if it still runs
  SandboxedChild(const SandboxedChild&) = delete;
  SandboxedChild& operator=(const SandboxedChild&) = delete;

  // Fills `bytes` from the child's output; false if that ends first. Throws std::runtime_error when
  // the time limit has passed.
  bool read(std::span<std::byte> bytes);
  // Gives the child bytes to read; false if it takes no more. Throws as read.
  bool write(std::span<const std::byte> bytes);
  // Once a stop is requested, reading, writing and ending() soon throw std::runtime_error.
  void give_up_on(std::stop_token stop) { stop_ = std::move(stop); }

  // Waits for its end, and says in words how it came: empty if it exited with status 0.
  std::string ending();

 private:
  void start(const std::string& program, int input_fd);
  bool wait_for(int fd, short event);
  void reap();

  std::chrono::steady_clock::time_point deadline_;
  std::stop_token stop_;
  int child_ = -1;      // process id; -1 once reaped
  int input_fd_ = -1;   // where we write; -1 = nowhere
  int output_fd_ = -1;  // where we read
  int status_ = 0;
};

}  // namespace capture
