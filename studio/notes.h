// What a show tells of itself, in words.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace studio {

// A note without its numbers: those of a kind differ in them alone.
inline std::string kind_of_note(const std::string& note) {
  std::string kind;
  for (const char c : note) {
    if (c >= '0' && c <= '9') {
      if (kind.empty() || kind.back() != '#') kind += '#';
    } else {
      kind += c;
    }
  }
  return kind;
}

// What a show tells while it runs. Any thread may use it.
class Notes {
 public:
  // Of the last ones a few are kept. Where they are too many, one of the same kind goes, so that
  // what is told of every frame does not hide the rest.
  void add(std::string what);
  // Those that are kept, and how many there were in all.
  std::pair<std::vector<std::string>, std::int64_t> told() const;
  // All since the last call.
  std::vector<std::string> take_new();

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> kept_, new_;
  std::int64_t all_ = 0;
};

}  // namespace studio
