// Chunks of sound with times, laid one after another without gaps.
#include "compositing/sound_track.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <string>

namespace compositing {

SoundTrack::SoundTrack(int channels, int rate) : channels_(channels), rate_(rate) {
  if (channels < 1 || rate < 1) {
    throw std::invalid_argument("a sound track needs channels and a rate, not " +
                                std::to_string(channels) + " at " + std::to_string(rate));
  }
}

std::optional<LaidSound> SoundTrack::lay(const capture::Sound& chunk,
                                         capture::Time start,
                                         capture::Time latest) {
  if (chunk.channels != channels_ || chunk.rate != rate_ || chunk.time > latest) {
    return std::nullopt;
  }
  const std::int64_t rounding = rate_ / 200;
  // In double, so that no time can overflow; exact to a sample for a take of a thousand years.
  const double after_start_s =
      1e-9 * (static_cast<double>(chunk.time.count()) - static_cast<double>(start.count()));
  const auto count =
      static_cast<std::int64_t>(chunk.samples.size()) / static_cast<std::int64_t>(channels_);
  const double place = std::round(after_start_s * rate_);
  if (place + static_cast<double>(count) <= static_cast<double>(length_)) return LaidSound{};
  std::int64_t first = static_cast<std::int64_t>(place);
  if (length_ > 0 && std::abs(first - length_) <= rounding) first = length_;
  const std::int64_t left_out = std::clamp<std::int64_t>(length_ - first, 0, count);
  const LaidSound laid{std::max<std::int64_t>(first - length_, 0),
                       std::span(chunk.samples)
                           .subspan(static_cast<std::size_t>(left_out * channels_),
                                    static_cast<std::size_t>((count - left_out) * channels_))};
  length_ += laid.silence + count - left_out;
  return laid;
}

}  // namespace compositing
