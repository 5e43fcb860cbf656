// The direction of every pixel, made once per camera.
#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "calibrate/axial_lens.h"
#include "calibrate/lens.h"
#include "calibrate/mrcal_lens.h"
#include "capture/parallel_loop.h"

namespace calibrate {
namespace {

// (sin(angle) / radius, cos(angle)) over the square of the radius, tabulated and interpolated by
// Catmull-Rom cubics. Both are smooth in the square. Where interpolation would err by more than a
// float shows (towards a lens's fold), the lens itself is asked.
class RayTable {
 public:
  RayTable(const AxialLens& lens, double max_radius)
      : lens_(lens),
        cells_per_unit_(cells / (max_radius * max_radius)),
        node_(cells + 3),
        exact_(cells + 1, true) {
    const double limit = lens.max_radius();
    for (std::size_t i = 0; i < node_.size(); ++i) {
      // Node 0 lies one cell below the axis, where the even functions mirror.
      const double u = std::abs(static_cast<double>(i) - 1) / cells_per_unit_;
      node_[i] = lens.ray_of_radius(std::min(std::sqrt(u), limit));
    }
    for (std::size_t cell = 0; cell < cells; ++cell) {
      const double u = (static_cast<double>(cell) + 0.5) / cells_per_unit_;
      if (static_cast<double>(cell + 2) / cells_per_unit_ > limit * limit) continue;
      const Vec2 truth = lens.ray_of_radius(std::sqrt(u));
      const Vec2 guess = interpolated(cell, 0.5);
      exact_[cell] = std::abs(guess.x - truth.x) + std::abs(guess.y - truth.y) > tolerance;
    }
  }

  Vec2 operator()(double radius_squared) const {
    const double at = radius_squared * cells_per_unit_;
    const auto cell = std::min(static_cast<std::size_t>(at), cells);
    if (exact_[cell]) {
      return lens_.ray_of_radius(std::min(std::sqrt(radius_squared), lens_.max_radius()));
    }
    return interpolated(cell, at - static_cast<double>(cell));
  }

 private:
  static constexpr std::size_t cells = 2048;
  static constexpr double tolerance = 2e-9;

  Vec2 interpolated(std::size_t cell, double f) const {
    const double f2 = f * f;
    const double f3 = f2 * f;
    const std::array<double, 4> w{0.5 * (-f3 + 2 * f2 - f), 0.5 * (3 * f3 - 5 * f2 + 2),
                                  0.5 * (-3 * f3 + 4 * f2 + f), 0.5 * (f3 - f2)};
    Vec2 sum;
    for (std::size_t i = 0; i < 4; ++i) {
      sum.x += w[i] * node_[cell + i].x;
      sum.y += w[i] * node_[cell + i].y;
    }
    return sum;
  }

  AxialLens lens_;
  double cells_per_unit_;
  std::vector<Vec2> node_;
  std::vector<std::uint8_t> exact_;
};

// One row of the table; x holds the columns' picture coordinates in focal lengths.
struct Row {
  std::span<const double> columns;
  double y;
  float *out_x, *out_y, *out_z;
};

// `ray` gives (sin(angle) / radius, cos(angle)) of a squared radius.
template <class Ray>
void fill(const Row& row, double max_radius_squared, const Ray& ray) {
  const double y2 = row.y * row.y;
  for (std::size_t i = 0; i < row.columns.size(); ++i) {
    const double x = row.columns[i];
    const double u = x * x + y2;
    const bool seen = u <= max_radius_squared;
    const Vec2 r = ray(seen ? u : 0.0);
    row.out_x[i] = seen ? static_cast<float>(x * r.x) : 0.0F;
    row.out_y[i] = seen ? static_cast<float>(row.y * r.x) : 0.0F;
    row.out_z[i] = seen ? static_cast<float>(r.y) : 0.0F;
  }
}

void fill_axial(const Lens& lens, DirectionTable& table) {
  const AxialLens axial(lens);
  const Vec2 f = axial.focal_px();
  const Vec2 c = axial.centre();
  std::vector<double> columns(static_cast<std::size_t>(lens.width) + 2);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    columns[i] = (static_cast<double>(i) - 1 - c.x) / f.x;
  }
  const double limit = axial.max_radius() * axial.max_radius();
  const double far_x = std::max(std::abs(columns.front()), std::abs(columns.back()));
  const double far_y = std::max(std::abs(-1 - c.y), std::abs(lens.height - c.y)) / f.y;
  const RayTable tabulated(axial, std::min(std::hypot(far_x, far_y), axial.max_radius()));
  const auto fill_rows = [&](auto ray) {
    capture::parallel_for(tbb::blocked_range<int>(-1, lens.height + 1), [&](const auto& rows) {
      for (int y = rows.begin(); y != rows.end(); ++y) {
        const std::size_t begin = table.index(y, -1);
        fill(Row{columns, (y - c.y) / f.y, &table.x[begin], &table.y[begin], &table.z[begin]},
             limit, ray);
      }
    });
  };
  switch (axial.kind()) {
    case AxialLens::Kind::pinhole:
      fill_rows([](double u) {
        const double cosine = 1 / std::sqrt(1 + u);
        return Vec2{cosine, cosine};
      });
      break;
    case AxialLens::Kind::equisolid:
      fill_rows([](double u) { return Vec2{std::sqrt(std::max(1 - u / 4, 0.0)), 1 - u / 2}; });
      break;
    case AxialLens::Kind::decentred_kannala_brandt:  // is asked for every pixel
    case AxialLens::Kind::kannala_brandt:
      fill_rows([&tabulated](double u) { return tabulated(u); });
      break;
  }
}

// Asks the lens for every pixel.
void fill_by_pixel(const Lens& lens, DirectionTable& table) {
  capture::parallel_for(tbb::blocked_range<int>(-1, lens.height + 1), [&](const auto& rows) {
    std::vector<Vec2> pixels(static_cast<std::size_t>(lens.width) + 2);
    for (int y = rows.begin(); y != rows.end(); ++y) {
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        pixels[i] = {static_cast<double>(i) - 1, static_cast<double>(y)};
      }
      const auto directions = unproject_all(lens, pixels);
      const std::size_t begin = table.index(y, -1);
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        const Vec3f v = to_float(directions[i].value_or(Vec3{}));
        table.x[begin + i] = v.x;
        table.y[begin + i] = v.y;
        table.z[begin + i] = v.z;
      }
    }
  });
}

}  // namespace

DirectionTable make_direction_table(const Lens& lens) {
  check(lens);
  DirectionTable table{lens.width, lens.height, {}, {}, {}};
  const std::size_t entries = table.index(lens.height, lens.width) + 1;
  table.x.resize(entries);
  table.y.resize(entries);
  table.z.resize(entries);
  if (is_mrcal_model(lens.model) || AxialLens(lens).decentred()) {
    fill_by_pixel(lens, table);
  } else {
    fill_axial(lens, table);
  }
  return table;
}

}  // namespace calibrate
