// Words and bars on a terminal.
#include "studio/console.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/text_file.h"
#include "compositing/output_file.h"

namespace studio {
namespace {

// Whether all of it was written.
bool print(std::FILE* file, const std::string& text) {
  const bool whole = std::fwrite(text.data(), 1, text.size(), file) == text.size();
  return std::fflush(file) == 0 && whole;
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
  print(stderr, "\r\033[K");
  bar_shown_ = false;
}

void Console::say(std::string_view line) {
  const std::lock_guard lock(mutex_);
  if (quiet_) return;
  clear_bar();
  if (!print(stdout, fmt::format("{}\n", line)) && !says_to_terminal_) lost_words_ = true;
}

void Console::warn(std::string_view line) {
  const std::lock_guard lock(mutex_);
  clear_bar();
  print(stderr, fmt::format("{}\n", line));
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
  print(stderr, fmt::format("\r[{:=<{}}{:<{}}] {}\033[K", "", full, "", width - full, what));
  bar_shown_ = true;
}

// What was there is replaced only if it was figures as well.
void require_figures_file(const std::string& path) {
  std::error_code none;
  if (std::filesystem::is_regular_file(path, none) && std::filesystem::file_size(path, none) > 0) {
    std::ifstream there(path, std::ios::binary);
    if (!nlohmann::json::accept(there)) {
      throw std::runtime_error(path + ": is there already, is no JSON, and would be lost: write " +
                               "the figures to another file");
    }
  }
  compositing::require_writable(path);
}

void Console::figures(std::string_view json) {
  if (figures_file_.empty()) return;
  require_figures_file(figures_file_);
  calibrate::write_text_file(figures_file_, std::string(json) + '\n');
}

}  // namespace studio
