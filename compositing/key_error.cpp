// Errors of keyed frames.
#include "compositing/key_error.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "render/made_noise.h"

namespace compositing {

std::array<float, 3> oklab_of(float r, float g, float b) {
  const auto root = [](float v) { return std::cbrt(std::max(v, 0.0F)); };
  const float l = root(0.4122214708F * r + 0.5363325363F * g + 0.0514459929F * b);
  const float m = root(0.2119034982F * r + 0.6806995451F * g + 0.1073969566F * b);
  const float s = root(0.0883024619F * r + 0.2817188376F * g + 0.6299787005F * b);
  return {0.2104542553F * l + 0.7936177850F * m - 0.0040720468F * s,
          1.9779984951F * l - 2.4285922050F * m + 0.4505937099F * s,
          0.0259040371F * l + 0.7827717662F * m - 0.8086757660F * s};
}

void KeyErrorSum::add(const capture::Image& keyed,
                      const capture::Image& truth,
                      const capture::Image& background) {
  const auto fits = [&](const capture::Image& image, int channels) {
    return image.height == keyed.height && image.width == keyed.width && image.channels == channels;
  };
  if (!fits(keyed, 4) || !fits(truth, 4) || !fits(background, 3)) {
    throw std::invalid_argument("keyed frame, truth and background differ in size");
  }
  const auto lab_over = [](const float* front, const float* back) {
    const auto over = [&](int c) {
      return std::clamp(front[c] + (1 - front[3]) * back[c], 0.0F, 1.0F);
    };
    return oklab_of(over(0), over(1), over(2));
  };
  const std::size_t pixels = background.pixels.size() / 3;
  for (std::size_t i = 0; i < pixels; ++i) {
    const float* k = &keyed.pixels[4 * i];
    const float* t = &truth.pixels[4 * i];
    const double off = k[3] - t[3];
    alpha_.add(off * off);
    if (t[3] < 0.001F) leak_.add(k[3]);
    if (t[3] > 0.999F) hole_.add(1 - k[3]);
    double distance = 0;
    if (!std::equal(k, k + 4, t)) {
      const auto a = lab_over(k, &background.pixels[3 * i]);
      const auto b = lab_over(t, &background.pixels[3 * i]);
      distance = 100 * std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    }
    composite_.add(distance);
    if (t[3] > 0.02F && t[3] < 0.98F) edge_.add(distance);
  }
}

KeyError KeyErrorSum::mean() const {
  return {composite_.mean(), edge_.mean(), alpha_.mean(), leak_.mean(), hole_.mean()};
}

void AlphaFlicker::add(const capture::Image& keyed) {
  const std::size_t pixels = keyed.pixels.size() / 4;
  if (frames_ == 0) {
    sums_.assign(pixels, 0);
    squares_.assign(pixels, 0);
  }
  if (keyed.channels != 4 || pixels != sums_.size()) {
    throw std::invalid_argument("keyed frames differ in size");
  }
  ++frames_;
  for (std::size_t i = 0; i < pixels; ++i) {
    const double alpha = keyed.pixels[4 * i + 3];
    sums_[i] += alpha;
    squares_[i] += alpha * alpha;
  }
}

double AlphaFlicker::deviation() const {
  if (frames_ < 2) return 0;
  double sum = 0;
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    sum += std::max(0.0, squares_[i] - sums_[i] * sums_[i] / frames_) / (frames_ - 1);
  }
  return std::sqrt(sum / static_cast<double>(sums_.size()));
}

capture::Image make_new_background(int height, int width) {
  capture::Image image = capture::make_image(height, width);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float u = static_cast<float>(x) / static_cast<float>(height);
      const float v = static_cast<float>(y) / static_cast<float>(height);
      const float noise = render::fractal_noise(6 * u, 6 * v, 4, 991);
      const float warm = render::smooth_step(0.2F, 0.8F, 0.5F * u + 0.1F + 0.1F * noise);
      const std::array<float, 3> cool{0.08F, 0.10F, 0.16F}, dusk{0.62F, 0.45F, 0.30F};
      for (int c = 0; c < 3; ++c) {
        const auto i = static_cast<std::size_t>(c);
        image.at(y, x, c) = (cool[i] + warm * (dusk[i] - cool[i])) * (1 + 0.5F * noise);
      }
    }
  }
  return image;
}

}  // namespace compositing
