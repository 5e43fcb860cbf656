// How far a shown person is from the true one.
#include "studio/charts/silhouette.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "compositing/key_error.h"

namespace studio {
namespace {

bool is_within(const capture::Image& rgba, int x, int y) {
  return x >= 0 && y >= 0 && x < rgba.width && y < rgba.height && rgba.at(y, x, 3) >= 0.5F;
}

// Pixels of the person with one beside them that is not.
std::vector<std::array<int, 2>> outline(const capture::Image& rgba) {
  std::vector<std::array<int, 2>> places;
  for (int y = 0; y < rgba.height; ++y) {
    for (int x = 0; x < rgba.width; ++x) {
      if (!is_within(rgba, x, y)) continue;
      if (!is_within(rgba, x - 1, y) || !is_within(rgba, x + 1, y) || !is_within(rgba, x, y - 1) ||
          !is_within(rgba, x, y + 1)) {
        places.push_back({x, y});
      }
    }
  }
  return places;
}

double mean_distance(const std::vector<std::array<int, 2>>& from,
                     const std::vector<std::array<int, 2>>& to) {
  double sum = 0;
  for (const auto& a : from) {
    int nearest = 1 << 30;
    for (const auto& b : to) {
      const int dx = a[0] - b[0], dy = a[1] - b[1];
      nearest = std::min(nearest, dx * dx + dy * dy);
    }
    sum += std::sqrt(nearest);
  }
  return sum / static_cast<double>(from.size());
}

}  // namespace

PersonError person_error(const capture::Image& shown,
                         const capture::Image& truth,
                         const capture::Image& plate) {
  const auto fits = [&](const capture::Image& image, int channels) {
    return image.height == plate.height && image.width == plate.width && image.channels == channels;
  };
  if (!fits(shown, 4) || !fits(truth, 4) || !fits(plate, 3)) {
    throw std::invalid_argument("picture, truth and plate differ in size");
  }
  double distances = 0, counted = 0, wrong = 0, true_pixels = 0;
  for (int y = 0; y < plate.height; ++y) {
    for (int x = 0; x < plate.width; ++x) {
      const float alpha = truth.at(y, x, 3);
      true_pixels += alpha >= 0.5F;
      wrong += std::abs(shown.at(y, x, 3) - alpha) > 0.5F;
      if (!(alpha > 0 || shown.at(y, x, 3) > 0)) continue;
      const auto one = [](float v) { return std::clamp(v, 0.0F, 1.0F); };
      const auto seen = [&](int c) { return one(shown.at(y, x, c)); };
      const auto wanted = [&](int c) {
        return one(truth.at(y, x, c) + (1 - alpha) * plate.at(y, x, c));
      };
      const auto a = compositing::oklab_of(seen(0), seen(1), seen(2));
      const auto b = compositing::oklab_of(wanted(0), wanted(1), wanted(2));
      distances += 100 * std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
      ++counted;
    }
  }
  PersonError error;
  error.composite = counted > 0 ? distances / counted : 0;
  error.wrong_share = true_pixels > 0 ? wrong / true_pixels : 0;
  const auto a = outline(shown), b = outline(truth);
  if (!a.empty() && !b.empty()) {
    error.silhouette_px = 0.5 * (mean_distance(a, b) + mean_distance(b, a));
  }
  return error;
}

}  // namespace studio
