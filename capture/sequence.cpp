// Numbered picture files as one camera.
#include "capture/sequence.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>
#include <optional>
#include <regex>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "capture/picture_camera.h"

namespace capture {
namespace {

// A gap longer than this is not a row of lost frames but two sequences.
constexpr std::int64_t max_gap = 10'000;

constexpr std::size_t max_digits = 12;

struct Pattern {
  std::filesystem::path folder;
  std::string before;  // of the file name, around the number
  std::string after;
  std::size_t width = 0;  // digits at least
};

std::optional<Pattern> parse(const std::string& path) {
  const std::filesystem::path whole(path);
  const std::string name = whole.filename().string();
  static const std::regex place("%(?:0([1-9]))?d");
  std::smatch match;
  if (!std::regex_search(name, match, place)) {
    return std::nullopt;
  }
  return Pattern{whole.parent_path().empty() ? "." : whole.parent_path(), match.prefix().str(),
                 match.suffix().str(),
                 match[1].matched ? static_cast<std::size_t>(match[1].str()[0] - '0') : 0};
}

// The number in a file name that printf would have written there.
std::optional<std::int64_t> number_in(const std::string& name, const Pattern& pattern) {
  if (name.size() <= pattern.before.size() + pattern.after.size() ||
      !name.starts_with(pattern.before) || !name.ends_with(pattern.after)) {
    return std::nullopt;
  }
  const std::string_view digits = std::string_view(name).substr(
      pattern.before.size(), name.size() - pattern.before.size() - pattern.after.size());
  const bool padded = digits.size() > 1 && digits.front() == '0';
  if (digits.size() > max_digits || digits.size() < pattern.width ||
      (padded && digits.size() != pattern.width) ||
      digits.find_first_not_of("0123456789") != std::string_view::npos) {
    return std::nullopt;
  }
  std::int64_t number = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return number;
}

Pattern pattern_of(const std::string& path) {
  if (const std::optional<Pattern> pattern = parse(path)) return *pattern;
  throw std::invalid_argument("a sequence needs %d or %04d in its file name: " + path);
}

}  // namespace

bool is_sequence(const std::string& path) {
  std::error_code error;
  return parse(path).has_value() && !std::filesystem::exists(path, error);
}

std::map<std::int64_t, std::string> numbered_files(const std::string& path) {
  const Pattern pattern = pattern_of(path);
  std::error_code error;
  std::map<std::int64_t, std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(pattern.folder, error)) {
    const std::optional<std::int64_t> number = number_in(entry.path().filename().string(), pattern);
    if (number) {
      files[*number] = entry.path().string();
    }
  }
  if (error) {
    throw std::runtime_error("cannot open " + path + ": " + error.message());
  }
  if (files.empty()) {
    throw std::runtime_error("cannot open " + path + ": no file in " + pattern.folder.string() +
                             " is named so");
  }
  std::int64_t expected = files.begin()->first;
  for (const auto& [number, file] : files) {
    if (number - expected > max_gap) {
      throw std::runtime_error("cannot open " + path + ": " + std::to_string(number - expected) +
                               " files are missing before " + file +
                               "; keep two sequences in two folders");
    }
    expected = number + 1;
  }
  return files;
}

std::vector<std::pair<std::int64_t, std::int64_t>> missing_numbers(
    const std::map<std::int64_t, std::string>& files) {
  std::vector<std::pair<std::int64_t, std::int64_t>> gaps;
  std::int64_t expected = files.empty() ? 0 : files.begin()->first;
  for (const auto& [number, file] : files) {
    if (number > expected) gaps.emplace_back(expected, number - 1);
    expected = number + 1;
  }
  return gaps;
}

std::string numbered_file(const std::string& path, std::int64_t number) {
  const Pattern pattern = pattern_of(path);
  std::string digits = std::to_string(number);
  if (digits.size() < pattern.width) digits.insert(0, pattern.width - digits.size(), '0');
  return (pattern.folder / (pattern.before + digits + pattern.after)).string();
}

std::unique_ptr<Camera> open_sequence(const std::string& path,
                                      const CameraOptions& options,
                                      const LightCurves& curves) {
  const std::map<std::int64_t, std::string> files = numbered_files(path);
  std::vector<PictureEntry> entries;
  std::int64_t expected = files.begin()->first;
  const auto add = [&](const std::string& file, FrameStatus status, const std::string& note) {
    const Time time =
        time_of_frame(static_cast<std::int64_t>(entries.size()), options.picture_rate);
    entries.push_back({file, time, 0, status, note});
  };
  for (const auto& [number, file] : files) {
    for (; expected < number; ++expected) {
      add("", FrameStatus::lost, "there is no file with the number " + std::to_string(expected));
    }
    add(file, FrameStatus::good, "");
    ++expected;
  }
  return make_picture_camera(path, std::move(entries), options.picture_rate, options, curves);
}

}  // namespace capture
