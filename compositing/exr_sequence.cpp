// A take as a folder of OpenEXR files: half R, G, B, A and matte, one file per frame.
#include "compositing/exr_sequence.h"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "capture/exr.h"

namespace compositing {
namespace {

constexpr std::array<std::pair<const char*, capture::ExrCompression>, 4> compressions{{
    {"none", capture::ExrCompression::none},
    {"rle", capture::ExrCompression::rle},
    {"zip", capture::ExrCompression::zip},
    {"piz", capture::ExrCompression::piz},
}};

capture::ExrCompression compression_from_name(const std::string& name) {
  std::string names;
  for (const auto& [known, compression] : compressions) {
    if (name == known) return compression;
    names += (names.empty() ? "\"" : ", \"") + std::string(known) + "\"";
  }
  throw std::invalid_argument("no EXR compression \"" + name + "\"; there are " + names);
}

// A label as the file counts it, at `base` frames in a second of timecode: nothing where there is
// no room for it.
//
// SMPTE ST 12-1, "Time and Control Code", clause 12: at 48, 50 and 60 frames per second, pairs are
// counted, and the field mark tells the second frame of a pair.
std::optional<capture::ExrTimecode> label_of(const Timecode& timecode, int base) {
  constexpr int most_counted = 40;  // the attribute counts 0 to 39
  const bool in_pairs = base == 48 || base == 50 || base == 60;
  if (base > most_counted && !in_pairs) return std::nullopt;
  capture::ExrTimecode label{timecode.hours, timecode.minutes, timecode.seconds, timecode.frames,
                             timecode.drop_frame};
  if (in_pairs) {
    label.frames = timecode.frames / 2;
    label.second_of_pair = timecode.frames % 2 != 0;
  }
  return label;
}

}  // namespace

ExrSequence::ExrSequence(const ExrSequenceSettings& settings) : settings_(settings) {
  compression_from_name(settings.compression);
  std::error_code error;
  std::filesystem::create_directories(settings.dir, error);
  if (error) {
    throw std::runtime_error(settings.dir + ": cannot be made: " + error.message());
  }
  if (::access(settings.dir.c_str(), W_OK | X_OK) != 0 ||
      !std::filesystem::is_directory(settings.dir, error)) {
    throw std::runtime_error(settings.dir + ": no folder that can be written to: " +
                             std::generic_category().message(errno != 0 ? errno : ENOTDIR));
  }
  lock_.emplace(settings.dir);
}

std::string ExrSequence::path_of(std::int64_t number) const {
  std::array<char, 64> name{};
  std::snprintf(name.data(), name.size(), "frame.%06lld.exr", static_cast<long long>(number));
  return (std::filesystem::path(settings_.dir) / name.data()).string();
}

std::string ExrSequence::pattern_in(const std::string& folder) {
  return (std::filesystem::path(folder) / "frame.%06d.exr").string();
}

std::int64_t ExrSequence::frames_in(const std::string& folder) {
  std::int64_t frames = 0;
  std::error_code none;
  for (const auto& file : std::filesystem::directory_iterator(folder, none)) {
    const std::string name = file.path().filename().string();
    frames += name.starts_with("frame.") && name.ends_with(".exr") ? 1 : 0;
  }
  return frames;
}

void ExrSequence::write(std::int64_t number,
                        const capture::HalfImage& rgba,
                        const capture::HalfImage& matte,
                        const std::optional<Timecode>& timecode) const {
  capture::ExrOptions options;
  options.compression = compression_from_name(settings_.compression);
  options.frames_per_second = settings_.rate;
  options.pixel_aspect = settings_.pixel_aspect;
  if (timecode) options.timecode = label_of(*timecode, timecode_base(settings_.rate));
  const std::array<capture::ExrPlanes, 2> planes{capture::ExrPlanes{rgba, {"R", "G", "B", "A"}},
                                                 capture::ExrPlanes{matte, {"matte"}}};
  capture::write_exr(path_of(number), planes, options);
}

}  // namespace compositing
