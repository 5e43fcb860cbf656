// Pictures of 8-bit grey.
#include "calibrate/grey_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

namespace calibrate {
namespace {

constexpr int max_side = 16384;
constexpr double gamma = 2.2;
constexpr double clipped_share = 0.005;
constexpr double stretched_share = 0.05;

float luminance(const capture::Image& image, std::size_t pixel) {
  const float* p = &image.pixels[pixel * static_cast<std::size_t>(image.channels)];
  if (image.channels == 1) return p[0];
  return 0.2126F * p[0] + 0.7152F * p[1] + 0.0722F * p[2];  // Rec.709
}

// Weights of the four samples around a point at the fraction t between the inner two.
std::array<float, 4> catmull_rom(float t) {
  return {0.5F * t * (-1 + t * (2 - t)), 0.5F * (2 + t * t * (-5 + 3 * t)),
          0.5F * t * (1 + t * (4 - 3 * t)), 0.5F * t * t * (t - 1)};
}

// What one sample of a line of `to` covers of a line of `from`: first sample and weights.
struct Cover {
  int first = 0;
  std::vector<float> weights;
};

std::vector<Cover> covers(int from, int to) {
  std::vector<Cover> result(static_cast<std::size_t>(to));
  const double scale = static_cast<double>(from) / to;
  const double reach = std::max(scale, 1.0) / 2;
  for (int i = 0; i < to; ++i) {
    Cover& cover = result[static_cast<std::size_t>(i)];
    const double centre = (i + 0.5) * scale;  // in edges: sample k covers k to k + 1
    const double low = centre - reach;
    const double high = centre + reach;
    cover.first = static_cast<int>(std::floor(low));
    for (int k = cover.first; k < high; ++k) {
      cover.weights.push_back(static_cast<float>(
          (std::min(high, k + 1.0) - std::max(low, static_cast<double>(k))) / (2 * reach)));
    }
  }
  return result;
}

}  // namespace

void check(const GreyPicture& picture) {
  const auto fits = [](int side) { return side >= 1 && side <= max_side; };
  if (!fits(picture.width) || !fits(picture.height) ||
      picture.pixels.size() != picture.index(picture.height, 0)) {
    throw std::invalid_argument("a grey picture of " + std::to_string(picture.width) + "x" +
                                std::to_string(picture.height) + " cannot have " +
                                std::to_string(picture.pixels.size()) + " pixels");
  }
}

GreyPicture grey_picture(const capture::Image& image) {
  if (image.empty() || (image.channels != 1 && image.channels != 3 && image.channels != 4)) {
    throw std::invalid_argument("a board is looked for in a picture of 1, 3 or 4 channels");
  }
  std::vector<float> light(image.pixels.size() / static_cast<std::size_t>(image.channels));
  for (std::size_t i = 0; i < light.size(); ++i) {
    const float value = luminance(image, i);
    light[i] = value > 0 ? value : 0;  // also where it is no number
  }
  std::vector<float> sorted = light;
  const auto top = sorted.begin() + static_cast<std::ptrdiff_t>(static_cast<double>(sorted.size()) *
                                                                (1 - clipped_share));
  std::nth_element(sorted.begin(), top, sorted.end());
  const float white = *top > 0 && std::isfinite(*top) ? *top : 1;

  GreyPicture grey{image.width, image.height, {}};
  grey.pixels.reserve(light.size());
  for (const float value : light) {
    const double share = std::min(static_cast<double>(value / white), 1.0);
    grey.pixels.push_back(static_cast<std::uint8_t>(std::lround(255 * std::pow(share, 1 / gamma))));
  }
  return grey;
}

float value_at(const GreyPicture& picture, Vec2 q) {
  const double x = std::clamp(q.x, 0.0, picture.width - 1.0);
  const double y = std::clamp(q.y, 0.0, picture.height - 1.0);
  const int left = static_cast<int>(x);
  const int top = static_cast<int>(y);
  const std::array<float, 4> across = catmull_rom(static_cast<float>(x - left));
  const std::array<float, 4> down = catmull_rom(static_cast<float>(y - top));
  float sum = 0;
  for (int j = 0; j < 4; ++j) {
    const int row = std::clamp(top + j - 1, 0, picture.height - 1);
    float line = 0;
    for (int i = 0; i < 4; ++i) {
      const int column = std::clamp(left + i - 1, 0, picture.width - 1);
      line += across[static_cast<std::size_t>(i)] * static_cast<float>(picture.at(row, column));
    }
    sum += down[static_cast<std::size_t>(j)] * line;
  }
  return sum;
}

GreyPicture resized(const GreyPicture& picture, int width, int height) {
  const std::vector<Cover> across = covers(picture.width, width);
  const std::vector<Cover> down = covers(picture.height, height);
  GreyPicture result{width, height, {}};
  result.pixels.resize(result.index(height, 0));
  std::vector<float> row(static_cast<std::size_t>(picture.width));
  for (int y = 0; y < height; ++y) {
    const Cover& rows = down[static_cast<std::size_t>(y)];
    std::ranges::fill(row, 0.0F);
    for (std::size_t k = 0; k < rows.weights.size(); ++k) {
      const int from = std::clamp(rows.first + static_cast<int>(k), 0, picture.height - 1);
      for (int x = 0; x < picture.width; ++x) {
        row[static_cast<std::size_t>(x)] +=
            rows.weights[k] * static_cast<float>(picture.at(from, x));
      }
    }
    for (int x = 0; x < width; ++x) {
      const Cover& columns = across[static_cast<std::size_t>(x)];
      float sum = 0;
      for (std::size_t k = 0; k < columns.weights.size(); ++k) {
        const int from = std::clamp(columns.first + static_cast<int>(k), 0, picture.width - 1);
        sum += columns.weights[k] * row[static_cast<std::size_t>(from)];
      }
      result.at(y, x) = static_cast<std::uint8_t>(std::clamp(std::lround(sum), 0L, 255L));
    }
  }
  return result;
}

GreyPicture stretched(const GreyPicture& picture) {
  std::array<std::size_t, 256> counts{};
  for (const std::uint8_t code : picture.pixels) ++counts[code];
  const double share = stretched_share * static_cast<double>(picture.pixels.size());
  const auto first_beyond = [&](auto code, auto last, int step) {
    double sum = 0;
    for (; code != last; code += step) {
      sum += static_cast<double>(counts[static_cast<std::size_t>(code)]);
      if (sum > share) break;
    }
    return code;
  };
  const int black = first_beyond(0, 255, 1);
  const int white = std::max(first_beyond(255, 0, -1), black + 1);
  std::array<std::uint8_t, 256> codes{};
  for (int i = 0; i < 256; ++i) {
    codes[static_cast<std::size_t>(i)] =
        static_cast<std::uint8_t>(std::clamp(255 * (i - black) / (white - black), 0, 255));
  }
  GreyPicture result = picture;
  for (std::uint8_t& code : result.pixels) code = codes[code];
  return result;
}

}  // namespace calibrate
