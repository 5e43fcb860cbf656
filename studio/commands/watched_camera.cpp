// What a camera sees for some seconds, to compare with another.
#include "studio/commands/watched_camera.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>

namespace studio {
namespace {

// Of a board, as small pictures: half a gigabyte.
constexpr std::size_t most_watched_pictures = 1500;
constexpr std::size_t fewest_seen = 20;

// Of about ten thousand pixels; what is not finite has no light.
double brightness_of(const capture::Image& image) {
  constexpr std::size_t looked_at = 10'000;
  const auto channels = static_cast<std::size_t>(image.channels);
  const std::size_t pixels = image.pixels.size() / channels;
  // Odd, so that it does not fall in step with even widths.
  const std::size_t step = std::max<std::size_t>(1, pixels / looked_at) | 1U;
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < pixels; i += step) {
    for (std::size_t c = 0; c < channels; ++c) {
      const auto value = static_cast<double>(image.pixels[i * channels + c]);
      if (std::isfinite(value)) sum += value;
      count += 1;
    }
  }
  return sum / count;
}

}  // namespace

Watched watch(capture::Camera& camera,
              const std::string& name,
              double length_s,
              double exposure_s,
              bool for_board) {
  using Seconds = std::chrono::duration<double>;
  Watched watched;
  std::optional<double> first_s;
  std::optional<double> last_s;  // that was seen
  std::size_t seen = 0;
  std::size_t lost = 0;
  std::string why;
  while (const std::optional<capture::Frame> frame = camera.next()) {
    const double time_s = Seconds(frame->time).count();
    if (!first_s) first_s = time_s;
    // A live camera that went away loses frames for ever.
    if (time_s - *first_s >= length_s || watched.pictures.size() == most_watched_pictures) break;
    if (frame->status == capture::FrameStatus::lost || frame->image == nullptr) {
      ++lost;
      why = frame->note;
    } else if (!last_s || time_s > *last_s) {
      last_s = time_s;
      ++seen;
      if (for_board) {
        watched.pictures.push_back({time_s, small_picture(*frame->image)});
      } else {
        watched.brightness.push_back({time_s, brightness_of(*frame->image),
                                      frame->exposure_s > 0 ? frame->exposure_s : exposure_s});
      }
    }
  }
  if (lost > 0 && seen < fewest_seen) {
    throw std::runtime_error(fmt::format("{} lost {} of {} frames{}{}: is it connected?", name,
                                         lost, lost + seen,
                                         why.empty() ? "" : ", the last one: ", why));
  }
  return watched;
}

}  // namespace studio
