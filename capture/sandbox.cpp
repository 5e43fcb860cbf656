// Helper programs under limits: posix_spawn, resource limits, seccomp.
#include "capture/sandbox.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PLATELIGHT_SANITIZED 1
#else
#define PLATELIGHT_SANITIZED 0
#endif

namespace capture {
namespace {

std::string reason(int error) { return std::generic_category().message(error); }

void set_limit(__rlimit_resource resource, std::size_t value, const char* what) {
  const rlimit limit{value, value};
  if (setrlimit(resource, &limit) != 0) {
    throw std::runtime_error(std::string("cannot limit ") + what + ": " + reason(errno));
  }
}

// The system calls of a process that computes, and reads and writes what is open: everything else
// fails with EPERM, so that a decoder that was taken over can neither open a file nor start
// anything.
void allow_only_computing() {
#if defined(__x86_64__) && !PLATELIGHT_SANITIZED
  constexpr std::array allowed{
      SYS_read,        SYS_pread64,   SYS_write,          SYS_writev,
      SYS_lseek,       SYS_fstat,     SYS_newfstatat,     SYS_close,
      SYS_mmap,        SYS_munmap,    SYS_mremap,         SYS_mprotect,
      SYS_madvise,     SYS_brk,       SYS_futex,          SYS_rt_sigreturn,
      SYS_getpid,      SYS_gettid,    SYS_rt_sigprocmask, SYS_tgkill,
      SYS_sched_yield, SYS_getrandom, SYS_clock_gettime,  SYS_exit,
      SYS_exit_group,
  };
  std::vector<sock_filter> program{
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, arch)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, AUDIT_ARCH_X86_64, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
  };
  for (std::size_t i = 0; i < allowed.size(); ++i) {
    const auto to_allow = static_cast<unsigned char>(allowed.size() - i);
    program.push_back(
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<unsigned>(allowed[i]), to_allow, 0));
  }
  program.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM));
  program.push_back(BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW));
  const sock_fprog filter{static_cast<unsigned short>(program.size()), program.data()};
  // A kernel without seccomp answers EINVAL: the limits then stand alone.
  if (prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) != 0 && errno != EINVAL) {
    throw std::runtime_error("cannot filter system calls: " + reason(errno));
  }
#endif
}

struct Descriptor {
  int fd = -1;
  ~Descriptor() {
    if (fd >= 0) close(fd);
  }
};

// Attributes and file actions of posix_spawn, freed whatever happens.
struct SpawnPlan {
  posix_spawn_file_actions_t files{};
  posix_spawnattr_t attributes{};
  SpawnPlan() {
    posix_spawn_file_actions_init(&files);
    posix_spawnattr_init(&attributes);
  }
  ~SpawnPlan() {
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
  }
  SpawnPlan(const SpawnPlan&) = delete;
  SpawnPlan& operator=(const SpawnPlan&) = delete;
};

}  // namespace

void confine_this_process(const SandboxLimits& limits) {
  set_limit(RLIMIT_CORE, 0, "core files");
  set_limit(RLIMIT_CPU, static_cast<std::size_t>(limits.processor_time.count()), "processor time");
#if !PLATELIGHT_SANITIZED  // a sanitizer's shadow memory alone takes terabytes of address space
  set_limit(RLIMIT_AS, limits.memory_bytes, "memory");
#endif
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) {
    throw std::runtime_error("cannot give up privileges: " + reason(errno));
  }
  allow_only_computing();
}

std::string helper_path(const std::string& name) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (const char* folder = std::getenv("PLATELIGHT_HELPERS"); folder != nullptr && *folder != 0) {
    return (fs::path(folder) / name).string();
  }
  const fs::path beside = fs::read_symlink("/proc/self/exe", error).parent_path();
  const std::array places{beside / name, beside / ".." / "libexec" / "platelight" / name,
                          fs::path(PLATELIGHT_HELPER_DIR) / name};
  std::string searched;
  for (const fs::path& place : places) {
    if (access(place.c_str(), X_OK) == 0) return place.string();
    searched += "\n  " + place.string();
  }
  throw std::runtime_error("the helper program " + name + " is missing; looked for" + searched +
                           "\nReinstall Platelight, or set PLATELIGHT_HELPERS to its folder.");
}

SandboxedChild::SandboxedChild(const std::string& program,
                               int input_fd,
                               std::chrono::milliseconds time_limit)
    : deadline_(std::chrono::steady_clock::now() + time_limit) {
  start(program, input_fd);
}

SandboxedChild::SandboxedChild(const std::string& program, std::chrono::milliseconds time_limit)
    : deadline_(std::chrono::steady_clock::now() + time_limit) {
  // A socket, since writing to a pipe whose reader is gone raises a signal.
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    throw std::runtime_error("cannot make a socket to " + program + ": " + reason(errno));
  }
  Descriptor ours{ends[0]};
  const Descriptor its{ends[1]};
  start(program, its.fd);
  input_fd_ = std::exchange(ours.fd, -1);
}

void SandboxedChild::start(const std::string& program, int input_fd) {
  std::array<int, 2> pipe_fds{};
  if (pipe2(pipe_fds.data(), O_CLOEXEC) != 0) {
    throw std::runtime_error("cannot make a pipe to " + program + ": " + reason(errno));
  }
  constexpr int pipe_bytes =
      1 << 20;  // the default of 64 KiB costs a task switch each; best effort
  fcntl(pipe_fds[1], F_SETPIPE_SZ, pipe_bytes);

  SpawnPlan plan;
  posix_spawn_file_actions_adddup2(&plan.files, input_fd, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&plan.files, pipe_fds[1], STDOUT_FILENO);
  posix_spawn_file_actions_addopen(&plan.files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addclosefrom_np(&plan.files, STDERR_FILENO + 1);
  sigset_t none;
  sigset_t all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&plan.attributes, &none);
  posix_spawnattr_setsigdefault(&plan.attributes, &all);
  posix_spawnattr_setflags(&plan.attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);

  std::string name = program;
  std::array<char*, 2> arguments{name.data(), nullptr};
  std::array<char*, 1> environment{nullptr};
  pid_t child = -1;
  const int error = posix_spawn(&child, program.c_str(), &plan.files, &plan.attributes,
                                arguments.data(), environment.data());
  close(pipe_fds[1]);
  if (error != 0) {
    close(pipe_fds[0]);
    throw std::runtime_error("cannot start " + program + ": " + reason(error));
  }
  child_ = child;
  output_fd_ = pipe_fds[0];
}

SandboxedChild::~SandboxedChild() {
  if (child_ > 0) {
    kill(child_, SIGKILL);
    reap();
  }
  close(output_fd_);
  if (input_fd_ >= 0) close(input_fd_);
}

// Waits until `fd` is ready, a second at most; false if it is not.
bool SandboxedChild::wait_for(int fd, short event) {
  const auto left =
      std::chrono::ceil<std::chrono::milliseconds>(deadline_ - std::chrono::steady_clock::now());
  if (left.count() <= 0) throw std::runtime_error("it takes too long");
  if (stop_.stop_requested()) throw std::runtime_error("it is given up");
  pollfd waiting{fd, event, 0};
  const long longest = stop_.stop_possible() ? 20 : 1000;
  const int ready = poll(&waiting, 1, static_cast<int>(std::min<long>(left.count(), longest)));
  if (ready < 0 && errno != EINTR) {
    throw std::runtime_error("cannot wait for a helper program: " + reason(errno));
  }
  return ready > 0;
}

bool SandboxedChild::read(std::span<std::byte> bytes) {
  while (!bytes.empty()) {
    if (!wait_for(output_fd_, POLLIN)) continue;
    const ssize_t got = ::read(output_fd_, bytes.data(), bytes.size());
    if (got == 0) return false;
    if (got < 0 && errno != EINTR) {
      throw std::runtime_error("cannot read from a helper program: " + reason(errno));
    }
    if (got > 0) bytes = bytes.subspan(static_cast<std::size_t>(got));
  }
  return true;
}

bool SandboxedChild::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    if (!wait_for(input_fd_, POLLOUT)) continue;
    const ssize_t done = send(input_fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (done < 0 && (errno == EPIPE || errno == ECONNRESET)) return false;
    if (done < 0 && errno != EINTR && errno != EAGAIN) {
      throw std::runtime_error("cannot write to a helper program: " + reason(errno));
    }
    if (done > 0) bytes = bytes.subspan(static_cast<std::size_t>(done));
  }
  return true;
}

void SandboxedChild::reap() {
  while (waitpid(child_, &status_, 0) < 0 && errno == EINTR) {
  }
  child_ = -1;
}

std::string SandboxedChild::ending() {
  if (child_ > 0) {
    // A child that neither writes nor ends is as late as one that writes too slowly.
    std::array<std::byte, 4096> rest{};
    while (read(rest)) {
    }
    reap();
  }
  if (WIFSIGNALED(status_)) {
    const int signal = WTERMSIG(status_);
    if (signal == SIGXCPU) return "it takes too long";
    if (signal == SIGKILL) return "it takes too much time or memory";
    const char* name = sigabbrev_np(signal);
    return std::string("the helper program crashed (SIG") + (name != nullptr ? name : "?") + ")";
  }
  const int code = WEXITSTATUS(status_);
  return code == 0 ? "" : "the helper program ended with status " + std::to_string(code);
}

}  // namespace capture
