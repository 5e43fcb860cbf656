// What a command says: words, progress, figures.
#pragma once

#include <atomic>
#include <chrono>
#include <mutex>
#include <string>
#include <string_view>

namespace studio {

// Throws std::runtime_error if figures could not be written to a file: what is there and is no JSON
// stays.
void require_figures_file(const std::string& path);

// From any thread. Words that nobody can be told, since the terminal is gone or the log cannot be
// written, end nothing; lost_words() tells of them.
class Console {
 public:
  Console(bool quiet, std::string figures_file);
  ~Console();
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;

  // A line on standard output, unless quiet.
  void say(std::string_view line);
  // A line on standard error, quiet or not: what went wrong without ending the command.
  void warn(std::string_view line);
  // A bar on a terminal, at most ten times a second; nothing otherwise. `share` is 0 to 1.
  void progress(double share, std::string_view what);
  // Writes the command's figures, a JSON text, to the file of --json, if one was asked for. Throws
  // std::runtime_error if it cannot be written.
  void figures(std::string_view json);
  // Whether anybody wants figures: costly ones need not be made otherwise.
  bool wants_figures() const { return !figures_file_.empty(); }
  const std::string& figures_file() const { return figures_file_; }
  // Whether standard output, unless it is a terminal, could not be written.
  bool lost_words() const { return lost_words_; }

 private:
  void clear_bar();

  std::mutex mutex_;
  bool quiet_;
  bool terminal_;          // is what warnings and bars go to
  bool says_to_terminal_;  // where lines go
  bool bar_shown_ = false;
  std::atomic<bool> lost_words_ = false;
  std::string figures_file_;
  std::chrono::steady_clock::time_point bar_time_{};
};

}  // namespace studio
