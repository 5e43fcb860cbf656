// Light of frames: the darkest that matters, the brightest, and what saturates.
#include "capture/light_meter.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace capture {
namespace {

constexpr std::size_t most_sampled = 16384;

}  // namespace

LightMeter::LightMeter(LightMeterSettings settings) : settings_(std::move(settings)) {
  if (!(settings_.dark_share >= 0 && settings_.dark_share <= 1) || !(settings_.saturation > 0)) {
    throw std::invalid_argument("a light meter has a share of 0 to 1, and a saturation above 0");
  }
  const auto pixels = static_cast<std::size_t>(std::max(settings_.width, 0)) *
                      static_cast<std::size_t>(std::max(settings_.height, 0));
  if (!settings_.counts.empty() && settings_.counts.size() != pixels) {
    throw std::invalid_argument("a light meter's pixels are as many as its width and height say");
  }
}

void LightMeter::lay_out(const Image& image) {
  width_ = image.width;
  height_ = image.height;
  channels_ = image.channels;
  stretches_.clear();
  sample_.clear();
  const auto channels = static_cast<std::size_t>(image.channels);
  const std::size_t pixels = image.pixels.size() / channels;
  const bool all = settings_.counts.empty() || settings_.width != image.width ||
                   settings_.height != image.height ||
                   std::ranges::all_of(settings_.counts, [](std::uint8_t c) { return c == 0; });
  values_ = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    if (!all && settings_.counts[i] == 0) continue;
    const std::size_t first = i * channels;
    if (stretches_.empty() || stretches_.back().first + stretches_.back().count != first) {
      stretches_.push_back({first, 0});
    }
    stretches_.back().count += channels;
    values_ += channels;
  }
  // Steps that are no multiple of three take all channels.
  std::size_t step = (values_ + most_sampled - 1) / most_sampled;
  if (step % 3 == 0) ++step;
  std::size_t next = 0;  // counted over all stretches
  std::size_t before = 0;
  for (const Stretch& stretch : stretches_) {
    for (; next < before + stretch.count; next += step) {
      sample_.push_back(stretch.first + next - before);
    }
    before += stretch.count;
  }
}

FrameLight LightMeter::measure(const Image& image) {
  if (image.empty()) throw std::invalid_argument("a light meter needs a picture");
  if (image.width != width_ || image.height != height_ || image.channels != channels_) {
    lay_out(image);
  }
  const auto limit = static_cast<float>(settings_.saturation);
  float brightest = 0;
  std::int64_t below = 0;
  for (const Stretch& stretch : stretches_) {
    const float* value = &image.pixels[stretch.first];
    // Floats above 0 are in the order of their bits, whose maximum is a vector's.
    std::int32_t count = 0;
    std::int32_t most = 0;
    for (std::size_t i = 0; i < stretch.count; ++i) {
      const bool unsaturated = value[i] < limit;  // false for NaN
      count += unsaturated ? 1 : 0;
      most = std::max(most, unsaturated ? std::bit_cast<std::int32_t>(value[i]) : 0);
    }
    below += count;
    brightest = std::max(brightest, std::bit_cast<float>(most));
  }
  sampled_.clear();
  for (const std::size_t i : sample_) {
    const float value = image.pixels[i];
    sampled_.push_back(value < limit ? value : limit);
  }
  const auto rank =
      static_cast<std::size_t>(std::min(settings_.dark_share * static_cast<double>(sampled_.size()),
                                        static_cast<double>(sampled_.size() - 1)));
  std::ranges::nth_element(sampled_, sampled_.begin() + static_cast<std::ptrdiff_t>(rank));
  FrameLight light;
  light.dark = sampled_[rank];
  light.brightest = brightest;
  light.saturated = 1 - static_cast<double>(below) / static_cast<double>(values_);
  return light;
}

}  // namespace capture
