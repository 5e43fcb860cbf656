// Plates from shots of the empty screen, and from footage alone.
#include "compositing/clean_plate.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>

#include "capture/median.h"
#include "compositing/gap_filler.h"

namespace compositing {
namespace {

using capture::Image;

constexpr float least_share = 0.6F;  // of the key's excess: what counts as screen in footage
constexpr float chroma_tolerance = 0.12F;
constexpr std::size_t most_frames = 256;  // that a footage plate looks at
// How far from its median a pixel of a background that holds still may be: of its light, and more.
constexpr float still_share = 0.1F, still_least = 4e-3F;

std::string size_of(const Image& image) {
  return std::to_string(image.width) + "x" + std::to_string(image.height);
}

void check_frames(std::span<const Image> frames) {
  if (frames.empty()) throw std::invalid_argument("a clean plate is made of at least one frame");
  for (const Image& frame : frames) {
    const std::size_t values = static_cast<std::size_t>(std::max(frame.height, 0)) *
                               static_cast<std::size_t>(std::max(frame.width, 0)) * 3;
    if (frame.channels != 3 || values == 0 || frame.pixels.size() != values) {
      throw std::invalid_argument("a frame of a clean plate is not (height, width, 3)");
    }
    if (frame.height != frames[0].height || frame.width != frames[0].width) {
      throw std::invalid_argument("frames of a clean plate differ in size: " + size_of(frames[0]) +
                                  " and " + size_of(frame));
    }
  }
}

float clean(float value) { return value > 0 && value <= 1e9F ? value : 0; }

// Variance of one frame against its neighbour, as a line over light. That is blurred: its own noise
// would make the line flatter.
void measure_noise(std::span<const Image> frames, CleanPlate& plate) {
  if (frames.size() < 2) return;
  Image light = plate.light;
  blur_screen(light);
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t f = 1; f < frames.size(); ++f) {
    for (std::size_t i = 0; i < frames[f].pixels.size(); i += 7) {
      const double a = clean(frames[f - 1].pixels[i]), b = clean(frames[f].pixels[i]);
      if (a >= 0.98 || b >= 0.98) continue;  // clipped: without noise
      const double x = light.pixels[i], y = 0.5 * (a - b) * (a - b);
      n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
  }
  const double spread = n * sxx - sx * sx;
  if (n < 100 || !(spread > 0)) return;
  const double gain = std::max(0.0, (n * sxy - sx * sy) / spread);
  plate.noise_gain = static_cast<float>(gain);
  plate.noise_floor = std::max(least_noise_floor, static_cast<float>((sy - gain * sx) / n));
}

struct Ordered {
  float first, second, third, excess;
};

Ordered ordered(const float* light, ScreenColour colour) {
  const auto order = channels_of(colour);
  const auto at = [&](std::size_t i) { return clean(light[order[i]]); };
  const float a = at(0), b = at(1), c = at(2);
  return {a, b, c,
          has_two_primaries(colour) ? screen_excess<true>(a, b, c) : screen_excess<false>(a, b, c)};
}

// The most saturated large colour: the median of what has most of the screen's excess.
Ordered find_key(std::span<const Image> frames, ScreenColour colour) {
  std::vector<Ordered> all;
  const std::size_t pixels = frames[0].pixels.size() / 3;
  const std::size_t step = std::max<std::size_t>(1, pixels * frames.size() / 50000);
  for (std::size_t i = 0; i < pixels * frames.size(); i += step) {
    all.push_back(ordered(&frames[i / pixels].pixels[3 * (i % pixels)], colour));
  }
  const auto by_excess = [](const Ordered& a, const Ordered& b) { return a.excess > b.excess; };
  std::sort(all.begin(), all.end(), by_excess);
  const float high = all[all.size() / 20].excess;
  const auto low = std::find_if(all.begin(), all.end(),
                                [&](const Ordered& c) { return c.excess < least_share * high; });
  return all[static_cast<std::size_t>(low - all.begin()) / 2];
}

// The colour whose key has the greatest excess: a screen's also where it is the lesser part of the
// picture. Nothing if none has any.
std::optional<ScreenColour> most_saturated(std::span<const Image> frames) {
  std::optional<ScreenColour> best;
  float excess = 0;
  for (int i = 0; i <= static_cast<int>(ScreenColour::magenta); ++i) {
    const auto colour = static_cast<ScreenColour>(i);
    const float of_this = find_key(frames, colour).excess;
    if (of_this > excess) excess = of_this, best = colour;
  }
  return best;
}

bool is_screen(const Ordered& c, const Ordered& key) {
  if (c.excess < 0.35F * key.excess || c.excess > 3 * key.excess) return false;
  const float off = std::abs(c.second * key.first - key.second * c.first) +
                    std::abs(c.third * key.first - key.third * c.first);
  return off < chroma_tolerance * key.first * c.first;
}

}  // namespace

void blur_screen(Image& light) {
  constexpr int reach = 2;
  const auto pass = [&](int count, int lines, auto&& at) {
    std::vector<float> row(static_cast<std::size_t>(count));
    for (int line = 0; line < lines; ++line) {
      for (int c = 0; c < 3; ++c) {
        for (int i = 0; i < count; ++i) row[static_cast<std::size_t>(i)] = at(line, i, c);
        for (int i = 0; i < count; ++i) {
          const int from = std::max(0, i - reach), to = std::min(count - 1, i + reach);
          float sum = 0;
          for (int j = from; j <= to; ++j) sum += row[static_cast<std::size_t>(j)];
          at(line, i, c) = sum / static_cast<float>(to - from + 1);
        }
      }
    }
  };
  pass(light.width, light.height, [&](int y, int x, int c) -> float& { return light.at(y, x, c); });
  pass(light.height, light.width, [&](int x, int y, int c) -> float& { return light.at(y, x, c); });
}

float screen_share(const Image& light, ScreenColour colour) {
  const Ordered key = find_key({&light, 1}, colour);
  if (key.excess <= 0) return 0;
  const std::size_t pixels = light.pixels.size() / 3;
  std::size_t screen = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    screen += is_screen(ordered(&light.pixels[3 * i], colour), key) ? 1 : 0;
  }
  return static_cast<float>(screen) / static_cast<float>(pixels);
}

ScreenColour mean_colour(const Image& light) {
  std::array<double, 3> sum{};
  for (std::size_t i = 0; i < light.pixels.size(); ++i) sum[i % 3] += light.pixels[i];
  std::array<float, 3> mean{};
  for (std::size_t c = 0; c < 3; ++c) {
    mean[c] = static_cast<float>(sum[c] * 3 / static_cast<double>(light.pixels.size()));
  }
  return screen_colour_of(mean);
}

CleanPlate average_plate(std::span<const Image> frames) {
  check_frames(frames);
  CleanPlate plate;
  plate.light = capture::make_image(frames[0].height, frames[0].width);
  const float share = 1 / static_cast<float>(frames.size());
  for (const Image& frame : frames) {
    for (std::size_t i = 0; i < frame.pixels.size(); ++i) {
      plate.light.pixels[i] += share * clean(frame.pixels[i]);
    }
  }
  plate.colour = most_saturated(frames).value_or(mean_colour(plate.light));
  measure_noise(frames, plate);
  return plate;
}

CleanPlate background_from_footage(std::span<const Image> frames) {
  check_frames(frames);
  CleanPlate plate;
  plate.light = capture::make_image(frames[0].height, frames[0].width);
  plate.colour = most_saturated(frames).value_or(ScreenColour::green);
  std::vector<float> seen(frames.size());
  std::size_t known = 0;
  for (std::size_t i = 0; i < plate.light.pixels.size(); ++i) {
    std::ranges::transform(frames, seen.begin(),
                           [&](const Image& f) { return clean(f.pixels[i]); });
    const float median = plate.light.pixels[i] = capture::median_in_place(seen);
    const float near = still_share * median + still_least;
    const auto alike =
        std::ranges::count_if(seen, [&](float v) { return std::abs(v - median) <= near; });
    known += 2 * static_cast<std::size_t>(alike) > seen.size() ? 1 : 0;
  }
  plate.known = static_cast<float>(known) / static_cast<float>(plate.light.pixels.size());
  return plate;
}

CleanPlate plate_from_footage(std::span<const Image> frames) {
  check_frames(frames);
  return plate_from_footage(frames, most_saturated(frames).value_or(ScreenColour::green));
}

CleanPlate plate_from_footage(std::span<const Image> frames, ScreenColour colour) {
  check_frames(frames);
  const Ordered key = find_key(frames, colour);
  const std::size_t step = (frames.size() + most_frames - 1) / most_frames;
  CleanPlate plate;
  plate.colour = colour;
  plate.light = capture::make_image(frames[0].height, frames[0].width);
  Image& light = plate.light;
  GapFiller filler(light.height, light.width, 3);
  filler.clear();
  struct Seen {
    float excess;
    std::size_t frame;
  };
  std::vector<Seen> seen;
  double known = 0;
  for (int y = 0; y < light.height; ++y) {
    for (int x = 0; x < light.width; ++x) {
      seen.clear();
      for (std::size_t f = 0; f < frames.size(); f += step) {
        const Ordered c = ordered(&frames[f].pixels[frames[f].index(y, x)], colour);
        if (is_screen(c, key)) seen.push_back({c.excess, f});
      }
      // Where it is screen now and then only, those times may be something of its colour.
      if (seen.size() * 10 < (frames.size() + step - 1) / step || seen.empty()) continue;
      // Mixed with hair or shadowed it is darker: the brighter half's middle.
      const auto middle = seen.begin() + static_cast<std::ptrdiff_t>(seen.size() * 3 / 4);
      std::nth_element(seen.begin(), middle, seen.end(),
                       [](const Seen& a, const Seen& b) { return a.excess < b.excess; });
      const float* from = &frames[middle->frame].pixels[light.index(y, x)];
      for (int c = 0; c < 3; ++c) filler.value(y, x)[c] = clean(from[c]);
      filler.weight(y, x) = 1;
      known += 1;
    }
  }
  filler.fill();
  for (int y = 0; y < light.height; ++y) {
    for (int x = 0; x < light.width; ++x) {
      std::copy_n(filler.value(y, x), 3, &light.pixels[light.index(y, x)]);
    }
  }
  plate.known = static_cast<float>(known / (static_cast<double>(light.height) * light.width));
  return plate;
}

}  // namespace compositing
