// Every shift of a small picture.
#include "compositing/coarse_shift.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace compositing {
namespace {

constexpr float most_edge = 0.7F;  // of the logarithm: a factor of two
constexpr float least_light = 1e-3F;
constexpr float alike = 0.2F;  // likeness of pictures that may show the same
constexpr float apart = 2.5F;  // cells, between shifts that differ

std::size_t size_of(int rows, int columns) {
  return static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
}

// Where the top of the parabola through three values lies, from the middle one.
float top_of(float before, float here, float after) {
  const float bend = before - 2 * here + after;
  return bend < 0 ? std::clamp(0.5F * (before - after) / bend, -0.5F, 0.5F) : 0;
}

}  // namespace

CoarseShift::CoarseShift(int rows, int columns, std::span<const float> light)
    : rows_(rows), columns_(columns), across_(columns / 4), along_(rows / 4) {
  if (rows < 1 || columns < 1 || light.size() != size_of(rows, columns))
    throw std::invalid_argument("a picture's light is not of its size");
  for (Edges* edges : {&plate_, &seen_}) {
    for (auto& plane : *edges) plane.assign(light.size(), 0);
  }
  find_edges(light, plate_);
  likeness_.assign(size_of(2 * along_ + 1, 2 * across_ + 1), 0);
}

void CoarseShift::find_edges(std::span<const float> light, Edges& edges) const {
  const auto level = [&](int row, int column) {
    const float value = light[size_of(row, columns_) + static_cast<std::size_t>(column)];
    return std::log(std::isfinite(value) ? std::max(value, least_light) : least_light);
  };
  for (int row = 0; row + 1 < rows_; ++row) {
    for (int column = 0; column + 1 < columns_; ++column) {
      const float here = level(row, column);
      const std::size_t at = size_of(row, columns_) + static_cast<std::size_t>(column);
      edges[0][at] = std::clamp(level(row, column + 1) - here, -most_edge, most_edge);
      edges[1][at] = std::clamp(level(row + 1, column) - here, -most_edge, most_edge);
    }
  }
}

// The correlation of what both show.
float CoarseShift::likeness(int right, int down) const {
  float both = 0, seen = 0, plate = 0;
  const int first = std::max(right, 0), last = std::min(columns_, columns_ + right);
  for (int row = std::max(down, 0); row < std::min(rows_, rows_ + down); ++row) {
    const std::size_t here = size_of(row, columns_), there = size_of(row - down, columns_);
    for (std::size_t plane = 0; plane < 2; ++plane) {
      const float* const a = &seen_[plane][here];
      const float* const b = &plate_[plane][there];
      for (int column = first; column < last; ++column) {
        both += a[column] * b[column - right], seen += a[column] * a[column];
        plate += b[column - right] * b[column - right];
      }
    }
  }
  return seen > 0 && plate > 0 ? both / std::sqrt(seen * plate) : 0;
}

float& CoarseShift::at(int right, int down) {
  return likeness_[size_of(down + along_, 2 * across_ + 1) +
                   static_cast<std::size_t>(right + across_)];
}

std::size_t CoarseShift::find(std::span<const float> light, std::span<Shift> found) {
  if (light.size() != size_of(rows_, columns_))
    throw std::invalid_argument("a picture's light is not of its size");
  find_edges(light, seen_);
  const auto each = [this](auto&& visit) {
    for (int down = -along_; down <= along_; ++down) {
      for (int right = -across_; right <= across_; ++right) visit(right, down);
    }
  };
  each([this](int right, int down) { at(right, down) = likeness(right, down); });
  const auto beside = [this](int right, int down) {
    return at(std::clamp(right, -across_, across_), std::clamp(down, -along_, along_));
  };
  std::size_t count = 0;
  const auto is_taken = [&](int right, int down) {
    return std::ranges::any_of(found.first(count), [&](const Shift& shift) {
      return std::max(std::abs(shift.right - static_cast<float>(right)),
                      std::abs(shift.down - static_cast<float>(down))) < apart;
    });
  };
  for (; count < found.size(); ++count) {
    int best_right = 0, best_down = 0;
    float most = alike;
    each([&](int right, int down) {
      if (at(right, down) < most || is_taken(right, down)) return;
      most = at(right, down), best_right = right, best_down = down;
    });
    if (most <= alike) break;
    found[count] = {static_cast<float>(best_right) + top_of(beside(best_right - 1, best_down), most,
                                                            beside(best_right + 1, best_down)),
                    static_cast<float>(best_down) + top_of(beside(best_right, best_down - 1), most,
                                                           beside(best_right, best_down + 1))};
  }
  return count;
}

}  // namespace compositing
