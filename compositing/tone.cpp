// Schlick's curve, and what it is chosen by.
#include "compositing/tone.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "capture/parallel_loop.h"

namespace compositing {
namespace {

constexpr float most_brightening = 64;  // of what is next to black: p over the brightest
constexpr float darkest_told = 1.0F / 256;
constexpr float brightest_middle = 0.5F;
constexpr float darkest_measured = 1.0F / 1024;

// Luminance of scene-linear Rec.709.
float luminance_of(float r, float g, float b) { return 0.2126F * r + 0.7152F * g + 0.0722F * b; }

float clamped(capture::Half bits) {
  const float value = capture::float_from_half(bits);
  if (std::isnan(value)) return value;
  return std::clamp(value, -capture::half_max, capture::half_max);
}

// p with which `level` comes out as `shown`; both below 1 and below brightest.
float p_for(float level, float shown, float brightest) {
  return shown * (brightest - level) / (level * (1 - shown));
}

// Counts of luminances, 64 to an octave: the halves of a power of two are evenly spread, so their
// bits without the last four are about a logarithm.
class Histogram {
 public:
  void add(float luminance) {
    if (!(luminance > darkest_measured)) return;  // also not NaN
    const float value = std::min(luminance, capture::half_max);
    const auto bin = static_cast<std::size_t>(capture::half_from_float(value) >> shift);
    ++counts_[bin];
    most_[bin] = std::max(most_[bin], value);
  }
  void add(const Histogram& other) {
    for (std::size_t i = 0; i < bins; ++i) {
      counts_[i] += other.counts_[i];
      most_[i] = std::max(most_[i], other.most_[i]);
    }
  }
  std::uint64_t total() const {
    std::uint64_t sum = 0;
    for (const std::uint32_t count : counts_) sum += count;
    return sum;
  }
  // Below which that share of the luminances is.
  double quantile(double share) const {
    double left = share * static_cast<double>(total());
    for (std::size_t i = 0; i < bins; ++i) {
      const double count = counts_[i];
      if (count > 0 && left <= count) {
        // White, and what is clipped, begins a bin.
        return std::min<double>(begin(i) + (begin(i + 1) - begin(i)) * left / count, most_[i]);
      }
      left -= count;
    }
    return capture::half_max;
  }
  double geometric_mean() const {
    double sum = 0;
    for (std::size_t i = 0; i < bins; ++i) {
      if (counts_[i] > 0) sum += counts_[i] * std::log2((begin(i) + begin(i + 1)) / 2);
    }
    return std::exp2(sum / static_cast<double>(total()));
  }

 private:
  static constexpr int shift = 4;
  static constexpr std::size_t bins = 0x7C00 >> shift;  // up to infinity
  static double begin(std::size_t bin) {
    if (bin >= bins) return capture::half_max;
    return capture::float_from_half(static_cast<capture::Half>(bin << shift));
  }
  std::array<std::uint32_t, bins> counts_{};
  std::array<float, bins> most_{};
};

}  // namespace

float ToneCurve::factor(float luminance) const {
  if (luminance >= brightest) return 1 / luminance;
  const float l = luminance > 0 ? luminance : 0.0F;
  return p / ((p - 1) * l + brightest);
}

float ToneCurve::operator()(float luminance) const {
  if (!(luminance > 0)) return 0;
  return luminance >= brightest ? 1 : std::min(luminance * factor(luminance), 1.0F);
}

std::array<float, 2> parameters_of(const ToneCurve& curve) { return {curve.p, curve.brightest}; }

ToneCurve curve_of(const std::array<float, 2>& parameters) {
  const auto [p, brightest] = parameters;
  const bool good = std::isfinite(p) && p >= 1 && std::isfinite(brightest) && brightest > 0;
  return good ? ToneCurve{p, brightest} : ToneCurve{};
}

void apply_tone(const ToneCurve& curve,
                std::span<const capture::Half> rgba,
                std::span<capture::Half> toned) {
  for (std::size_t i = 0; i + 3 < rgba.size(); i += 4) {
    const float r = clamped(rgba[i]), g = clamped(rgba[i + 1]), b = clamped(rgba[i + 2]);
    const float luminance = luminance_of(r, g, b);
    const float factor = curve.factor(luminance);
    toned[i] = capture::half_from_float(r * factor);
    toned[i + 1] = capture::half_from_float(g * factor);
    toned[i + 2] = capture::half_from_float(b * factor);
    toned[i + 3] = rgba[i + 3];
  }
}

std::optional<PictureLevels> measure_levels(const capture::HalfImage& rgba) {
  const Histogram histogram = capture::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, rgba.pixels.size() / 4, 16384), Histogram{},
      [&](const tbb::blocked_range<std::size_t>& pixels, Histogram sum) {
        for (std::size_t i = pixels.begin(); i != pixels.end(); ++i) {
          sum.add(luminance_of(clamped(rgba.pixels[i * 4]), clamped(rgba.pixels[i * 4 + 1]),
                               clamped(rgba.pixels[i * 4 + 2])));
        }
        return sum;
      },
      [](Histogram a, const Histogram& b) {
        a.add(b);
        return a;
      });
  if (histogram.total() == 0) return std::nullopt;
  return PictureLevels{static_cast<float>(histogram.quantile(0.01)),
                       static_cast<float>(histogram.geometric_mean()),
                       static_cast<float>(histogram.quantile(0.999))};
}

ToneCurve curve_for(const PictureLevels& levels, std::optional<float> key) {
  ToneCurve curve;
  curve.brightest = std::clamp(levels.brightest, 1.0F, capture::half_max);
  const auto at_least = [&](float level, float shown) {
    if (!(level > 0) || !(level < curve.brightest)) return;
    curve.p = std::max(curve.p, p_for(level, shown, curve.brightest));
  };
  at_least(levels.darkest, std::min(levels.darkest, darkest_told));
  at_least(levels.middle, key.value_or(std::min(levels.middle, brightest_middle)));
  curve.p = std::min(curve.p, most_brightening * curve.brightest);
  return curve;
}

}  // namespace compositing
