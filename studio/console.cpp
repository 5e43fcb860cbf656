// Words and bars on a terminal.
#include "studio/console.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace studio {
namespace {

// A terminal may go while the command runs, which is no reason to end it.
template <typename... Args>
void print(bool terminal, std::FILE* file, fmt::format_string<Args...> format, Args&&... args) {
  try {
    fmt::print(file, format, std::forward<Args>(args)...);
  } catch (const std::system_error&) {
    if (!terminal) throw;
  }
}

}  // namespace

Console::Console(bool quiet, std::string figures_file)
    : quiet_(quiet),
      terminal_(isatty(STDERR_FILENO) == 1),
      says_to_terminal_(isatty(STDOUT_FILENO) == 1),
      figures_file_(std::move(figures_file)) {}

Console::~Console() { clear_bar(); }

void Console::clear_bar() {
  if (!bar_shown_) return;
  print(terminal_, stderr, "\r\033[K");
  bar_shown_ = false;
}

void Console::say(std::string_view line) {
  const std::lock_guard lock(mutex_);
  if (quiet_) return;
  clear_bar();
  print(says_to_terminal_, stdout, "{}\n", line);
  std::fflush(stdout);
}

void Console::warn(std::string_view line) {
  const std::lock_guard lock(mutex_);
  clear_bar();
  print(terminal_, stderr, "{}\n", line);
}

void Console::progress(double share, std::string_view what) {
  using namespace std::chrono_literals;
  if (quiet_ || !terminal_) return;
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  if (now - bar_time_ < 100ms && share < 1) return;
  bar_time_ = now;
  constexpr int width = 30;
  const int full = static_cast<int>(std::lround(std::clamp(share, 0.0, 1.0) * width));
  print(terminal_, stderr, "\r[{:=<{}}{:<{}}] {}\033[K", "", full, "", width - full, what);
  std::fflush(stderr);
  bar_shown_ = true;
}

void Console::figures(std::string_view json) {
  if (figures_file_.empty()) return;
  std::ofstream file(figures_file_, std::ios::binary | std::ios::trunc);
  file << json << '\n';
  file.close();
  if (!file) throw std::runtime_error(figures_file_ + ": the figures cannot be written");
}

}  // namespace studio
