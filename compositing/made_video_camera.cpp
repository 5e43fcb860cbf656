// The camera of made clips.
#include "compositing/made_video_camera.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "capture/colour.h"
#include "capture/counter_random.h"

namespace compositing {
namespace {

// Value 0..1 of light, from a table fine enough that no code is off by a tenth.
float value_of(float light) {
  constexpr int steps = 16384;
  static const std::vector<float> table = [] {
    std::vector<float> values(steps + 2);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double at = static_cast<double>(i) / steps;
      values[i] = static_cast<float>(capture::encode(capture::Transfer::srgb, at));
    }
    return values;
  }();
  const float at = std::clamp(light, 0.0F, 1.0F) * steps;
  const auto i = static_cast<std::size_t>(at);
  return table[i] + (at - static_cast<float>(i)) * (table[i + 1] - table[i]);
}

// Normal deviates, one of 65,536 equally likely ones.
float deviate(std::uint64_t bits) {
  static const std::vector<float> table = [] {
    std::vector<float> values(65536);
    for (std::size_t i = 0; i < values.size(); ++i) {
      values[i] =
          static_cast<float>(capture::normal_quantile((static_cast<double>(i) + 0.5) / 65536));
    }
    return values;
  }();
  return table[bits & 0xFFFF];
}

struct Plane {
  int height, width;
  std::vector<float> values;
  float& at(int y, int x) {
    return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                  static_cast<std::size_t>(x)];
  }
  // Bilinear between samples that sit amid 2x2 pixels.
  float between(int y, int x) {
    const float fy =
        std::clamp(0.5F * static_cast<float>(y) - 0.25F, 0.0F, static_cast<float>(height - 1));
    const float fx =
        std::clamp(0.5F * static_cast<float>(x) - 0.25F, 0.0F, static_cast<float>(width - 1));
    const int iy = static_cast<int>(fy), ix = static_cast<int>(fx);
    const int jy = std::min(iy + 1, height - 1), jx = std::min(ix + 1, width - 1);
    const float u = fx - static_cast<float>(ix), v = fy - static_cast<float>(iy);
    const float top = at(iy, ix) + u * (at(iy, jx) - at(iy, ix));
    const float low = at(jy, ix) + u * (at(jy, jx) - at(jy, ix));
    return top + v * (low - top);
  }
};

// R'G'B' through 4:2:0 of 8 bits and back.
void halve_chroma(capture::Image& values) {
  constexpr float kr = 0.2126F, kg = 0.7152F, kb = 0.0722F;
  const int h = values.height, w = values.width;
  const auto make_plane = [](int height, int width) {
    return Plane{
        height, width,
        std::vector<float>(static_cast<std::size_t>(height) * static_cast<std::size_t>(width))};
  };
  Plane luma = make_plane(h, w), count = make_plane((h + 1) / 2, (w + 1) / 2);
  Plane cb = count, cr = count;
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const float r = values.at(y, x, 0), b = values.at(y, x, 2);
      const float l = kr * r + kg * values.at(y, x, 1) + kb * b;
      luma.at(y, x) = std::round(16 + 219 * l);
      cb.at(y / 2, x / 2) += (b - l) / (2 * (1 - kb));
      cr.at(y / 2, x / 2) += (r - l) / (2 * (1 - kr));
      count.at(y / 2, x / 2) += 1;
    }
  }
  for (std::size_t i = 0; i < cb.values.size(); ++i) {
    cb.values[i] = std::round(128 + 224 * cb.values[i] / count.values[i]);
    cr.values[i] = std::round(128 + 224 * cr.values[i] / count.values[i]);
  }
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const float l = (luma.at(y, x) - 16) / 219;
      const float r = l + 2 * (1 - kr) * (cr.between(y, x) - 128) / 224;
      const float b = l + 2 * (1 - kb) * (cb.between(y, x) - 128) / 224;
      values.at(y, x, 0) = r;
      values.at(y, x, 1) = (l - kr * r - kb * b) / kg;
      values.at(y, x, 2) = b;
    }
  }
}

}  // namespace

std::vector<std::uint8_t> photograph_light(const capture::Image& light,
                                           const MadeSensor& sensor,
                                           std::uint64_t seed) {
  capture::Image values = light;
  std::size_t i = 0;
  const auto expose = [&](std::uint64_t bits) {
    const float x = values.pixels[i];
    const float sd = std::sqrt(sensor.noise_gain * std::max(x, 0.0F) + sensor.noise_floor);
    values.pixels[i++] = value_of(x + sd * deviate(bits));
  };
  while (i < values.pixels.size()) {
    const std::uint64_t bits = capture::mixed_bits(seed + i);  // for four values
    for (int k = 0; k < 4 && i < values.pixels.size(); ++k) expose(bits >> (16 * k));
  }
  if (sensor.halved_chroma) halve_chroma(values);
  std::vector<std::uint8_t> codes(values.pixels.size());
  for (std::size_t j = 0; j < codes.size(); ++j) {
    codes[j] =
        static_cast<std::uint8_t>(std::lround(std::clamp(values.pixels[j], 0.0F, 1.0F) * 255));
  }
  return codes;
}

}  // namespace compositing
