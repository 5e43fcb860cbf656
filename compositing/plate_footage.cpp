// Plates from shots of the empty screen, and from footage alone.
#include "compositing/plate_footage.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>

#include "capture/half.h"
#include "capture/median.h"
#include "capture/parallel_loop.h"
#include "compositing/gap_filler.h"
#include "compositing/plate_noise.h"

namespace compositing {
namespace {

using capture::HalfImage;
using capture::Image;

constexpr const char* no_frames = "a clean plate is made of at least one frame";
constexpr std::size_t noise_step = 7;  // every so many values tell noise
// A pixel of which so few frames show the screen is not it: those may be something of its colour.
constexpr std::size_t least_seen = 10;  // of so many frames, one
// Mixed with hair or shadowed the screen is darker: the brighter half's middle.
constexpr double bright_quantile = 0.75;
constexpr int rows_of_task = 32;
// An even number.
constexpr std::size_t most_frames = 96;
constexpr double least_values = 100;  // of shots, that tell noise
// How far from its median a pixel of a background that holds still may be: of its light, and more.
constexpr float still_share = 0.1F, still_least = 4e-3F;

template <class Picture>
std::string size_of(const Picture& image) {
  return std::to_string(image.width) + "x" + std::to_string(image.height);
}

template <class Picture>
void check_frame(const Image& frame, const Picture* first) {
  const std::size_t values = static_cast<std::size_t>(std::max(frame.height, 0)) *
                             static_cast<std::size_t>(std::max(frame.width, 0)) * 3;
  if (frame.channels != 3 || values == 0 || frame.pixels.size() != values) {
    throw std::invalid_argument("a frame of a clean plate is not (height, width, 3)");
  }
  if (first != nullptr && (frame.height != first->height || frame.width != first->width)) {
    throw std::invalid_argument("frames of a clean plate differ in size: " + size_of(*first) +
                                " and " + size_of(frame));
  }
}

// Frames that are all the same, as of a video that holds still, tell none.
void set_noise(const std::optional<PlateNoise>& noise, CleanPlate& plate) {
  if (!noise) return;
  plate.noise_gain = noise->gain, plate.noise_floor = noise->floor;
  plate.knows_noise = noise->gain > 0 || noise->floor > least_noise_floor;
}

// Codecs take noise away, and errors that they leave hold still: footage never has less than what
// is taken for it untold.
void set_footage_noise(std::optional<PlateNoise> noise, CleanPlate& plate) {
  if (!noise) return;
  noise->gain = std::max(noise->gain, plate.noise_gain);
  noise->floor = std::max(noise->floor, plate.noise_floor);
  set_noise(noise, plate);
}

bool is_near(float light, float median) {
  return std::abs(light - median) <= still_share * median + still_least;
}

}  // namespace

void PlateShots::add(const Image& frame) {
  check_frame(frame, count_ > 0 ? &last_ : nullptr);
  sum_.resize(frame.pixels.size());
  for (std::size_t i = 0; i < sum_.size(); ++i) sum_[i] += clean(frame.pixels[i]);
  const std::size_t measured = (frame.pixels.size() + noise_step - 1) / noise_step;
  steps_.resize(measured), steps_count_.resize(measured);
  for (std::size_t k = 0; k < measured && count_ > 0; ++k) {
    const double a = clean(last_.pixels[k * noise_step]), b = clean(frame.pixels[k * noise_step]);
    if (a >= clipped_light || b >= clipped_light) continue;
    steps_[k] += 0.5 * (a - b) * (a - b);
    ++steps_count_[k];
  }
  last_ = frame;
  ++count_;
}

CleanPlate PlateShots::average(std::optional<ScreenColour> colour) const {
  if (count_ == 0) throw std::invalid_argument(no_frames);
  CleanPlate plate;
  plate.light = capture::make_image(last_.height, last_.width);
  std::ranges::transform(sum_, plate.light.pixels.begin(), [&](double sum) {
    return static_cast<float>(sum / static_cast<double>(count_));
  });
  if (!colour) colour = find_screen_colour(spread_pixels(plate.light));
  plate.colour = colour.value_or(mean_colour(plate.light));
  if (count_ < 2) return plate;
  // Variance of one frame against its neighbour, as a line over light. That is blurred: its own
  // noise would make the line flatter.
  Image light = plate.light;
  blur_screen(light);
  NoiseSums sums;
  for (std::size_t k = 0; k < steps_.size(); ++k) {
    sums.add(light.pixels[k * noise_step], steps_[k], steps_count_[k]);
  }
  set_noise(sums.line(least_values), plate);
  return plate;
}

void PlateFootage::add(const Image& frame) {
  check_frame(frame, frames_.empty() ? nullptr : &frames_.front());
  if (count_++ % step_ != 0) return;
  if (frames_.size() == most_frames) {
    for (std::size_t i = 1; i < most_frames / 2; ++i) frames_[i] = std::move(frames_[2 * i]);
    frames_.resize(most_frames / 2);
    step_ *= 2;
  }
  HalfImage& half = frames_.emplace_back(HalfImage{frame.height, frame.width, {}, 3});
  half.pixels.reserve(frame.pixels.size());
  constexpr std::size_t at_once = 1024;
  std::array<float, at_once> light;
  std::array<capture::Half, at_once> codes;
  for (std::size_t from = 0; from < frame.pixels.size(); from += at_once) {
    const std::size_t count = std::min(at_once, frame.pixels.size() - from);
    std::transform(&frame.pixels[from], &frame.pixels[from] + count, light.begin(),
                   [](float value) { return std::min(clean(value), capture::half_max); });
    capture::halves_from_floats({light.data(), count}, codes.data());
    half.pixels.insert(half.pixels.end(), codes.begin(), codes.begin() + count);
  }
}

// Spread evenly over all the pixels of the frames one after the other.
std::vector<Light3> PlateFootage::spread_pixels() const {
  if (frames_.empty()) throw std::invalid_argument(no_frames);
  const std::size_t in_frame = frames_.front().pixels.size() / 3;
  const std::size_t all = in_frame * frames_.size();
  std::vector<Light3> some;
  for (std::size_t i = 0; i < all; i += spread_step(all)) {
    const capture::Half* from = &frames_[i / in_frame].pixels[3 * (i % in_frame)];
    Light3& light = some.emplace_back();
    capture::floats_from_halves({from, 3}, light.data());
  }
  return some;
}

CleanPlate PlateFootage::screen(std::optional<ScreenColour> colour) const {
  const std::vector<Light3> pixels = spread_pixels();
  if (!colour) colour = find_screen_colour(pixels).value_or(ScreenColour::green);
  return screen(*colour, find_key(pixels, *colour));
}

CleanPlate PlateFootage::screen(ScreenColour colour, const ScreenLight& key) const {
  CleanPlate plate;
  plate.colour = colour;
  Image& light = plate.light = capture::make_image(frames_.front().height, frames_.front().width);
  GapFiller filler(light.height, light.width, 3);
  filler.clear();
  const auto columns = static_cast<std::size_t>(light.width);
  std::vector<int> known(static_cast<std::size_t>(light.height));
  const auto rows = [&](const tbb::blocked_range<int>& range) {
    // Of a row in each frame: its light, and the screen's excess, below 0 where it shows none.
    std::vector<float> lights(frames_.size() * columns * 3), excess(frames_.size() * columns);
    std::vector<std::size_t> showing;
    for (int y = range.begin(); y < range.end(); ++y) {
      for (std::size_t f = 0; f < frames_.size(); ++f) {
        float* const row = &lights[f * columns * 3];
        capture::floats_from_halves({&frames_[f].pixels[light.index(y, 0)], columns * 3}, row);
        for (std::size_t x = 0; x < columns; ++x) {
          const ScreenLight seen =
              screen_light({row[3 * x], row[3 * x + 1], row[3 * x + 2]}, colour);
          excess[f * columns + x] = is_screen(seen, key) ? seen.excess : -1;
        }
      }
      for (std::size_t x = 0; x < columns; ++x) {
        const auto excess_in = [&](std::size_t frame) { return excess[frame * columns + x]; };
        showing.clear();
        for (std::size_t f = 0; f < frames_.size(); ++f) {
          if (excess_in(f) >= 0) showing.push_back(f);
        }
        if (showing.empty() || showing.size() * least_seen < frames_.size()) continue;
        const double upper = bright_quantile * static_cast<double>(showing.size());
        const auto middle = showing.begin() + static_cast<std::ptrdiff_t>(upper);
        std::ranges::nth_element(showing, middle, {}, excess_in);
        std::copy_n(&lights[(*middle * columns + x) * 3], 3, filler.value(y, static_cast<int>(x)));
        filler.weight(y, static_cast<int>(x)) = 1;
        ++known[static_cast<std::size_t>(y)];
      }
    }
  };
  capture::parallel_for(tbb::blocked_range<int>(0, light.height, rows_of_task), rows);
  filler.fill();
  for (int y = 0; y < light.height; ++y) {
    std::copy_n(filler.value(y, 0), columns * 3, &light.pixels[light.index(y, 0)]);
  }
  plate.known = static_cast<float>(std::accumulate(known.begin(), known.end(), 0.0) /
                                   static_cast<double>(light.pixels.size() / 3));
  const auto shows = [&](std::size_t, int, const float* row, std::uint8_t* shown) {
    for (std::size_t x = 0; x < columns; ++x) {
      shown[x] = is_screen(screen_light({row[3 * x], row[3 * x + 1], row[3 * x + 2]}, colour), key);
    }
  };
  const float reaches = key.first / 2;  // or it is clipped
  auto noise = noise_of_steps(frames_, shows, reaches);
  if (!noise) noise = noise_of_grain(frames_, shows, reaches);
  set_footage_noise(noise, plate);
  return plate;
}

CleanPlate PlateFootage::background() const {
  CleanPlate plate;
  plate.colour = find_screen_colour(spread_pixels()).value_or(ScreenColour::green);
  Image& light = plate.light = capture::make_image(frames_.front().height, frames_.front().width);
  const auto values = static_cast<std::size_t>(light.width) * 3;
  std::vector<std::size_t> known(static_cast<std::size_t>(light.height));
  const auto rows = [&](const tbb::blocked_range<int>& range) {
    std::vector<float> lights(frames_.size() * values), seen(frames_.size());
    for (int y = range.begin(); y < range.end(); ++y) {
      const std::size_t first = light.index(y, 0);
      for (std::size_t f = 0; f < frames_.size(); ++f) {
        capture::floats_from_halves({&frames_[f].pixels[first], values}, &lights[f * values]);
      }
      for (std::size_t i = 0; i < values; ++i) {
        for (std::size_t f = 0; f < seen.size(); ++f) seen[f] = lights[f * values + i];
        const float median = light.pixels[first + i] = capture::median_in_place(seen);
        const auto alike = std::ranges::count_if(seen, [&](float v) { return is_near(v, median); });
        known[static_cast<std::size_t>(y)] += 2 * static_cast<std::size_t>(alike) > seen.size();
      }
    }
  };
  capture::parallel_for(tbb::blocked_range<int>(0, light.height, rows_of_task), rows);
  plate.known = static_cast<float>(
      static_cast<double>(std::accumulate(known.begin(), known.end(), std::size_t{0})) /
      static_cast<double>(light.pixels.size()));
  const auto shows = [&](std::size_t, int y, const float* row, std::uint8_t* shown) {
    const std::vector<float> median =
        smoothed_along(std::span(light.pixels).subspan(light.index(y, 0), values));
    for (std::size_t x = 0; 3 * x < values; ++x) {
      shown[x] = is_near(row[3 * x], median[3 * x]) && is_near(row[3 * x + 1], median[3 * x + 1]) &&
                 is_near(row[3 * x + 2], median[3 * x + 2]);
    }
  };
  set_footage_noise(noise_of_steps(frames_, shows), plate);
  return plate;
}

CleanPlate average_plate(std::span<const Image> frames, std::optional<ScreenColour> colour) {
  PlateShots shots;
  for (const Image& frame : frames) shots.add(frame);
  return shots.average(colour);
}

}  // namespace compositing
