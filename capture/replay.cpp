// Recorded frames played again.
#include "capture/replay.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "capture/files.h"
#include "capture/median.h"
#include "capture/picture_camera.h"

namespace capture {
namespace {

constexpr std::string_view header = "file,time_s,exposure_s,status";
constexpr std::size_t columns = 4;
constexpr std::size_t max_list_bytes = std::size_t{64} << 20;

// Times of a year and more are no recording's.
constexpr double max_time_s = 1e8;

std::array<std::string, columns> split(const std::string& line) {
  std::array<std::string, columns> fields;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < columns; ++i) {
    const std::size_t end = i + 1 < columns ? line.find(',', begin) : line.size();
    if (end == std::string::npos) {
      throw std::runtime_error("it needs four fields: " + std::string(header));
    }
    fields[i] = line.substr(begin, end - begin);
    begin = end + 1;
  }
  return fields;
}

double number_of(const std::string& field, std::string_view column) {
  double number = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), number);
  if (error != std::errc{} || end != field.data() + field.size() || !std::isfinite(number)) {
    throw std::runtime_error(std::string(column) + " is no number: \"" + field + "\"");
  }
  return number;
}

FrameStatus status_of(const std::string& field) {
  if (field == "good") {
    return FrameStatus::good;
  }
  if (field == "damaged") {
    return FrameStatus::damaged;
  }
  if (field == "lost") {
    return FrameStatus::lost;
  }
  throw std::runtime_error("status is none of good, damaged, lost: \"" + field + "\"");
}

std::string picture_of(const std::string& field,
                       FrameStatus status,
                       const std::filesystem::path& folder) {
  if (field.empty() && status == FrameStatus::lost) {
    return {};
  }
  const std::filesystem::path name(field);
  if (field.empty() || name.has_root_path() ||
      std::find(name.begin(), name.end(), "..") != name.end()) {
    throw std::runtime_error("file must name a picture in this folder: \"" + field + "\"");
  }
  return (folder / name).string();
}

PictureEntry entry_of(const std::string& line, const std::filesystem::path& folder) {
  const std::array<std::string, columns> fields = split(line);
  PictureEntry entry;
  entry.status = status_of(fields[3]);
  entry.path = picture_of(fields[0], entry.status, folder);
  const double time_s = number_of(fields[1], "time_s");
  if (std::abs(time_s) > max_time_s) {
    throw std::runtime_error("time_s is too large: " + fields[1]);
  }
  entry.time = Time{std::llround(time_s * std::nano::den)};
  entry.exposure_s = number_of(fields[2], "exposure_s");
  if (entry.exposure_s < 0) {
    throw std::runtime_error("exposure_s is below 0: " + fields[2]);
  }
  if (entry.status != FrameStatus::good) {
    entry.note = "so recorded";
  }
  return entry;
}

std::vector<PictureEntry> read_list(const std::filesystem::path& list) {
  const std::vector<std::byte> bytes = read_file(list.string(), max_list_bytes);
  std::istringstream text(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  std::vector<PictureEntry> entries;
  std::string line;
  for (int number = 1; std::getline(text, line); ++number) {
    if (!line.empty() && line.back() == '\r') {
      line.pop_back();
    }
    const auto fail = [&](const std::string& why) {
      throw std::runtime_error("cannot open " + list.string() + ", line " + std::to_string(number) +
                               ": " + why);
    };
    if (number == 1) {
      if (line != header) {
        fail("the first line must be " + std::string(header));
      }
      continue;
    }
    try {
      entries.push_back(entry_of(line, list.parent_path()));
    } catch (const std::runtime_error& error) {
      // A line without its end was being written when the recording was cut off.
      if (text.eof() && !entries.empty()) break;
      fail(error.what());
    }
    if (entries.size() > 1 && entries.back().time <= entries[entries.size() - 2].time) {
      fail("time_s does not rise");
    }
  }
  if (entries.empty()) {
    throw std::runtime_error("cannot open " + list.string() + ": it lists no frames");
  }
  const Time first = entries.front().time;
  for (PictureEntry& entry : entries) {
    entry.time -= first;
  }
  return entries;
}

// The pictures in a folder, in the order of their names.
std::vector<PictureEntry> read_bracket(const std::filesystem::path& folder, Rational rate) {
  std::vector<std::string> pictures;
  std::error_code error;
  for (const auto& file : std::filesystem::directory_iterator(folder, error)) {
    if (file.is_regular_file() && is_picture(file.path().string())) {
      pictures.push_back(file.path().string());
    }
  }
  if (error) {
    throw std::runtime_error("cannot open replay:" + folder.string() + ": " + error.message());
  }
  if (pictures.empty()) {
    throw std::runtime_error("cannot open replay:" + folder.string() +
                             ": there is neither frames.csv nor a picture in it");
  }
  std::sort(pictures.begin(), pictures.end());
  std::vector<PictureEntry> entries;
  for (const std::string& picture : pictures) {
    const Time time = time_of_frame(static_cast<std::int64_t>(entries.size()), rate);
    entries.push_back({picture, time, exposure_in(picture), FrameStatus::good, {}});
  }
  return entries;
}

// How fast recorded frames follow each other: most of their steps are one frame time, or several
// where frames were left out, to a quarter of it. 0/1 where that is not so, or they are few.
Rational rate_of(const std::vector<PictureEntry>& entries) {
  constexpr std::size_t enough = 8;
  constexpr double off = 0.25, most = 0.9, of_clocks = 4e-4;
  if (entries.size() < enough) {
    return {};
  }
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < entries.size(); ++i) {
    steps_s.push_back(std::chrono::duration<double>(entries[i].time - entries[i - 1].time).count());
  }
  const double frame_s = median(steps_s);
  double frames = 0, length_s = 0;
  std::size_t even = 0;
  for (const double step_s : steps_s) {
    const double count = std::round(step_s / frame_s);
    if (count < 1 || std::abs(step_s / frame_s - count) > off) {
      continue;
    }
    ++even;
    frames += count;
    length_s += step_s;
  }
  const bool regular = static_cast<double>(even) >= most * static_cast<double>(steps_s.size());
  if (!regular) {
    return {};
  }
  const double rate = frames / length_s;
  // A short recording tells its rate only so well.
  const double tolerance = of_clocks + off * frame_s / length_s;
  return nominal_rate(rate, tolerance).value_or(Rational{std::llround(rate * 1000), 1000});
}

}  // namespace

std::unique_ptr<Camera> open_replay(const std::string& folder,
                                    const CameraOptions& options,
                                    const LightCurves& curves) {
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    throw std::runtime_error("cannot open replay:" + folder + ": no such folder");
  }
  const std::filesystem::path list = std::filesystem::path(folder) / "frames.csv";
  const bool recorded = std::filesystem::exists(list, error);
  std::vector<PictureEntry> entries =
      recorded ? read_list(list) : read_bracket(folder, options.picture_rate);
  const Rational rate = recorded ? rate_of(entries) : options.picture_rate;
  return make_picture_camera("replay:" + folder, std::move(entries), rate, options, curves,
                             recorded && rate.num > 0 ? time_of_frame(1, rate) / 4 : Time{});
}

}  // namespace capture
