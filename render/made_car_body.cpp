// The made car's body: band, deck, cabin, floor, arches, handles, wipers.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "render/made_car.h"
#include "render/made_car_shape.h"
#include "render/made_car_trim.h"
#include "render/surface_patches.h"

namespace render {
namespace {

using std::numbers::pi;

class BodyMaker {
 public:
  BodyMaker() {
    band_ = [this](double way, double z) { return shape_.band(way, z); };
    deck_ = [this](double x, double share) { return shape_.deck(x, share); };
    cabin_ = [this](double foot_x, double share) { return shape_.cabin(foot_x, share); };
    CarTrim trim = make_car_trim(shape_);
    mesh_ = std::move(trim.mesh);
    band_cuts_ = std::move(trim.on_band);
    cabin_cuts_ = std::move(trim.on_cabin);
  }

  Mesh make() {
    add_band();
    add_deck();
    add_cabin();
    add_floor();
    add_arches();
    add_handles();
    add_wipers();
    return std::move(mesh_);
  }

 private:
  // Whether all corners of a cell lie under a patch.
  template <class Reflect>
  static bool covered(const std::vector<CoveredArea>& cuts,
                      const std::array<std::array<double, 2>, 4>& corners,
                      Reflect&& reflections) {
    return std::any_of(cuts.begin(), cuts.end(), [&](const CoveredArea& cut) {
      const auto all_inside = [&](auto&& map) {
        return std::all_of(corners.begin(), corners.end(),
                           [&](const auto& corner) { return cut.covers(map(corner)); });
      };
      return reflections(cut.both_sides(), all_inside);
    });
  }
  template <class Parameters>
  static std::array<std::array<double, 2>, 4> cell(Parameters&& parameters, int row, int column) {
    return {parameters(row, column), parameters(row, column + 1), parameters(row + 1, column + 1),
            parameters(row + 1, column)};
  }

  // Ways along the left half of the band, front to back: even, with the arches' own and the seams'.
  std::vector<double> band_ways() {
    std::vector<double> ways;
    constexpr double spacing = 0.0185;
    const double half = shape_.length() / 2;
    const auto n = static_cast<int>(half / spacing);
    for (int i = 0; i <= n; ++i) ways.push_back(half * i / n);
    const auto clear = [&](double from, double to) {
      std::erase_if(ways, [=](double way) { return way > from && way < to; });
    };
    for (const float axle : {car_front_axle_x, car_rear_axle_x}) {
      const double r = CarShape::arch_radius;
      clear(shape_.way_at_x(axle + r + 0.012), shape_.way_at_x(axle - r - 0.012));
      ways.push_back(shape_.way_at_x(axle + r + 0.0015));
      ways.push_back(shape_.way_at_x(axle - r - 0.0015));
      constexpr int steps = 56;
      for (int i = 0; i <= steps; ++i)
        ways.push_back(shape_.way_at_x(axle + (r - 1e-6) * std::cos(pi * i / steps)));
    }
    for (const double x : {0.70, -0.385, -1.0}) {
      const double at = shape_.way_at_x(x);
      clear(at - 0.012, at + 0.012);
      seams_.push_back(at);
      for (const double step : {-0.0065, -0.003, 0.003, 0.0065}) ways.push_back(at + step);
    }
    std::sort(ways.begin(), ways.end());
    return ways;
  }

  bool in_seam(double way) const {
    return std::any_of(seams_.begin(), seams_.end(),
                       [way](double seam) { return std::abs(way - seam) < 0.0035; });
  }

  void add_band() {
    const std::vector<double> half = band_ways();
    std::vector<double> ways = half;
    for (auto way = half.rbegin() + 1; way != half.rend(); ++way)
      ways.push_back(shape_.length() - *way);
    constexpr int rows = 36;
    GridPatch grid;
    grid.rows = rows;
    grid.columns = static_cast<int>(ways.size());
    grid.parameters = [&](int row, int column) {
      const double way = ways[static_cast<std::size_t>(column)];
      const double x = shape_.x_at_way(way);
      const double from = shape_.sill_z(x), to = shape_.shoulder_z(x);
      return std::array<double, 2>{way, from + (to - from) * row / (rows - 1)};
    };
    const auto side_way = [&](double way) { return std::min(way, shape_.length() - way); };
    grid.material = [&](int row, int column) -> std::optional<std::uint32_t> {
      const auto corners = cell(grid.parameters, row, column);
      const auto reflect = [&](bool both_sides, auto&& all_inside) {
        const double length = shape_.length();
        return all_inside([](const auto& c) { return c; }) || all_inside([length](const auto& c) {
                 return std::array{c[0] - length, c[1]};
               }) ||
               (both_sides && all_inside([length](const auto& c) {
                  return std::array{length - c[0], c[1]};
                }));
      };
      if (covered(band_cuts_, corners, reflect)) return std::nullopt;
      const double way = side_way((corners[0][0] + corners[1][0]) / 2);
      const double z = (corners[0][1] + corners[2][1]) / 2;
      if (z > 0.26 && in_seam(way)) return index(CarMaterial::seam);
      const bool low = z < 0.235;
      return index(low ? CarMaterial::plastic : CarMaterial::paint);
    };
    grid.depth_m = [&](int row, int column) {
      const auto [way, z] = grid.parameters(row, column);
      return z > 0.25 && in_seam(side_way(way)) ? 0.006 : 0.0;
    };
    // Outside of the band is dway x dz.
    add_grid(mesh_, band_, grid);
  }

  // Whether a point of the deck lies under the cabin.
  bool under_cabin(double x, double share) const {
    const double foot = std::acos(std::clamp(share / 0.94, -1.0, 1.0)) / pi;
    const double front = shape_.cabin(CarShape::cabin_front_x, foot).x;
    const double rear = shape_.cabin(CarShape::cabin_rear_x, foot).x;
    return x < front - 0.012 && x > rear + 0.012;
  }

  void add_deck() {
    // Across: a shut line on either side of bonnet and hatch.
    std::vector<double> shares;
    constexpr int columns = 36;
    for (int i = 0; i <= columns; ++i) shares.push_back(2.0 * i / columns - 1);
    std::erase_if(shares, [](double s) { return std::abs(std::abs(s) - 0.915) < 0.03; });
    for (const double s : {0.902, 0.908, 0.918, 0.924}) {
      shares.push_back(s);
      shares.push_back(-s);
    }
    std::sort(shares.begin(), shares.end());
    const auto add = [&](const std::vector<double>& along) {
      GridPatch grid;
      grid.rows = static_cast<int>(along.size());
      grid.columns = static_cast<int>(shares.size());
      grid.parameters = [&](int row, int column) {
        return std::array<double, 2>{along[static_cast<std::size_t>(row)],
                                     shares[static_cast<std::size_t>(column)]};
      };
      const auto in_shut_line = [](double x, double share) {
        const bool beside =
            std::abs(std::abs(share) - 0.913) < 0.0055 && x > 0 && x < bonnet_front_x;
        return beside || (std::abs(x - bonnet_front_x) < 0.004 && std::abs(share) < 0.919);
      };
      grid.material = [&, in_shut_line](int row, int column) -> std::optional<std::uint32_t> {
        const auto corners = cell(grid.parameters, row, column);
        if (std::all_of(corners.begin(), corners.end(),
                        [&](const auto& c) { return under_cabin(c[0], c[1]); }))
          return std::nullopt;
        const double x = (corners[0][0] + corners[2][0]) / 2;
        const double share = (corners[0][1] + corners[1][1]) / 2;
        if (in_shut_line(x, share)) return index(CarMaterial::seam);
        const double cowl = 1.075 - 0.17 * share * share;
        if (x > 0 && x < cowl) return index(CarMaterial::plastic);
        return index(CarMaterial::paint);
      };
      grid.depth_m = [&, in_shut_line](int row, int column) {
        const auto [x, share] = grid.parameters(row, column);
        return in_shut_line(x, share) ? 0.005 : 0.0;
      };
      Mesh part;
      add_grid(part, deck_, grid);
      smooth_normals(part);
      append_mesh(mesh_, part);
    };
    // Rows lie closer towards the ends, where the outline turns across.
    const auto rows_towards = [](double from, double to, int rows) {
      std::vector<double> along;
      for (int i = 0; i <= rows; ++i) {
        const double rest = 1 - static_cast<double>(i) / rows;
        along.push_back(to + (from - to) * rest * (0.3 + 0.7 * rest * rest));
      }
      return along;
    };
    const double nose = shape_.band(0, shape_.shoulder_z(CarShape::half_length)).x;
    const double tail =
        shape_.band(shape_.length() / 2, shape_.shoulder_z(-CarShape::half_length)).x;
    std::vector<double> bonnet = rows_towards(0.70, nose - 2e-5, 86);
    std::erase_if(bonnet, [](double x) { return std::abs(x - bonnet_front_x) < 0.007; });
    for (const double step : {-0.0065, -0.003, 0.003, 0.0065})
      bonnet.push_back(bonnet_front_x + step);
    std::sort(bonnet.begin(), bonnet.end());
    add(bonnet);
    std::vector<double> boot = rows_towards(-1.60, tail + 2e-5, 36);
    std::reverse(boot.begin(), boot.end());
    add(boot);
  }

  void add_cabin() {
    constexpr int rows = 124, columns = 81;
    GridPatch grid;
    grid.rows = rows;
    grid.columns = columns;
    grid.parameters = [](int row, int column) {
      const double t = static_cast<double>(row) / (rows - 1);
      return std::array<double, 2>{
          CarShape::cabin_rear_x + (CarShape::cabin_front_x - CarShape::cabin_rear_x) * t,
          static_cast<double>(column) / (columns - 1)};
    };
    grid.material = [&](int row, int column) -> std::optional<std::uint32_t> {
      const auto corners = cell(grid.parameters, row, column);
      const auto reflect = [](bool both_sides, auto&& all_inside) {
        return all_inside([](const auto& c) { return c; }) ||
               (both_sides && all_inside([](const auto& c) {
                  return std::array{c[0], 1 - c[1]};
                }));
      };
      if (covered(cabin_cuts_, corners, reflect)) return std::nullopt;
      const double x = (corners[0][0] + corners[2][0]) / 2;
      double share = (corners[0][1] + corners[1][1]) / 2;
      share = std::min(share, 1 - share);
      // The pillar between the doors, and the sills of the windows, are dark.
      const bool between_doors = x > -0.45 && x < -0.34 && share < 0.236;
      const bool sill = share < 0.034 && x > -1.58 && x < 0.88;
      const bool dark = between_doors || sill;
      return index(dark ? CarMaterial::plastic : CarMaterial::paint);
    };
    add_grid(mesh_, cabin_, grid);
  }

  void add_floor() {
    // Flat, between the lower edges; narrower between the wheels.
    const double half = shape_.length() / 2;
    std::vector<std::array<double, 2>> edge;  // x, half width
    constexpr int steps = 120;
    for (int i = 0; i <= steps; ++i) {
      const double way = half * (0.001 + 0.998 * i / steps);
      const Vec3 p = shape_.band(way, CarShape::floor_z);
      edge.push_back({p.x, p.y});
    }
    for (const float axle : {car_front_axle_x, car_rear_axle_x}) {
      const double r = CarShape::arch_radius;
      std::erase_if(edge, [&](const auto& e) { return std::abs(e[0] - axle) <= r; });
      const auto width_at = [&](double x) {
        return shape_.band(shape_.way_at_x(x), CarShape::floor_z).y;
      };
      edge.push_back({axle + r + 0.001, width_at(axle + r + 0.001)});
      edge.push_back({axle + r, well_y});
      edge.push_back({axle, well_y});
      edge.push_back({axle - r, well_y});
      edge.push_back({axle - r - 0.001, width_at(axle - r - 0.001)});
    }
    std::sort(edge.begin(), edge.end(), [](const auto& a, const auto& b) { return a[0] > b[0]; });
    const SmoothSurface flat = [](double x, double y) { return Vec3{x, y, CarShape::floor_z}; };
    GridPatch grid;
    grid.rows = static_cast<int>(edge.size());
    grid.columns = 9;
    grid.parameters = [&](int row, int column) {
      const auto& [x, width] = edge[static_cast<std::size_t>(row)];
      return std::array<double, 2>{x, width * (column / 4.0 - 1)};
    };
    grid.material = [](int, int) { return index(CarMaterial::plastic); };
    Mesh part;
    add_grid(part, flat, grid);
    for (Vec3f& n : part.normals) n = {0, 0, -1};
    append_mesh(mesh_, part);
  }

  void add_arches() {
    for (const float axle : {car_front_axle_x, car_rear_axle_x}) {
      const double r = CarShape::arch_radius;
      // The liner goes around the wheel from the band's edge inwards: share 0 is outside.
      const SmoothSurface liner = [this, axle, r](double angle, double share) {
        const double x = axle + (r - 1e-6) * std::cos(angle);
        const double z =
            angle < 0 || angle > pi ? car_wheel_radius_m : car_wheel_radius_m + r * std::sin(angle);
        const double outside = shape_.band(shape_.way_at_x(x), z).y;
        return Vec3{x, outside + (well_y - outside) * share, z};
      };
      GridPatch grid;
      grid.rows = 61;
      grid.columns = 7;
      grid.parameters = [](int row, int column) {
        return std::array<double, 2>{pi * row / 60.0, column / 6.0};
      };
      grid.material = [](int, int) { return index(CarMaterial::plastic); };
      Mesh part;
      add_grid(part, liner, grid);
      // Its straight ends, down to the floor, and the wall behind the wheel.
      for (const double side : {1.0, -1.0}) {
        const double x = axle + side * r;
        const SmoothSurface wall = [this, x](double z, double share) {
          const double outside = shape_.band(shape_.way_at_x(x), z).y;
          return Vec3{x, outside + (well_y - outside) * share, z};
        };
        grid.rows = 5;
        grid.parameters = [](int row, int column) {
          return std::array<double, 2>{
              CarShape::floor_z + (car_wheel_radius_m - CarShape::floor_z) * row / 4.0,
              column / 6.0};
        };
        add_grid(part, wall, grid);
      }
      const SmoothSurface back = [axle, r](double angle, double share) {
        const double z = car_wheel_radius_m + r * std::sin(angle);
        return Vec3{axle + r * std::cos(angle), well_y,
                    CarShape::floor_z + (z - CarShape::floor_z) * share};
      };
      grid.rows = 31;
      grid.parameters = [](int row, int column) {
        return std::array<double, 2>{0.001 + (pi - 0.002) * row / 30.0, column / 6.0};
      };
      add_grid(part, back, grid);
      append_mesh(mesh_, part);
      add_mirrored(mesh_, part);
    }
  }

  // Bars on the doors.
  void add_handles() {
    for (const double x : {-0.24, -0.86}) {
      const double way = shape_.way_at_x(x);
      const SmoothSurface handle = [this, way](double along, double across) {
        const double t = 2 * along - 1;
        const double thick = std::pow(std::max(0.0, 1 - std::pow(std::abs(t), 6.0)), 0.5);
        const double angle = pi * across;
        const double at = way - 0.095 * t;
        const double z = 0.765 - 0.013 * thick * std::cos(angle);
        const Vec3 foot = shape_.band(at, z);
        return foot + normal_of(band_, at, z) * (0.024 * thick * std::sin(angle) - 0.001);
      };
      GridPatch grid;
      grid.rows = 25;
      grid.columns = 13;
      grid.parameters = [](int row, int column) {
        return std::array<double, 2>{row / 24.0, column / 12.0};
      };
      grid.material = [](int, int) { return index(CarMaterial::paint); };
      Mesh part;
      add_grid(part, handle, grid);
      smooth_normals(part);
      append_mesh(mesh_, part);
      add_mirrored(mesh_, part);
    }
  }

  void add_wipers() {
    for (const auto& [from, to] : {std::pair{0.66, 0.44}, {0.40, 0.72}}) {
      const SmoothSurface wiper = [this, from = from, to = to](double along, double across) {
        const double share = from + (to - from) * along;
        const double foot = 0.965 - 0.13 * along * (from < 0.5 ? 0.35 : 1.0);
        const double angle = pi * across;
        const Vec3 at = shape_.cabin(foot - 0.007 * std::cos(angle), share);
        return at + normal_of(cabin_, foot, share) * (0.004 + 0.012 * std::sin(angle));
      };
      GridPatch grid;
      grid.rows = 41;
      grid.columns = 7;
      grid.parameters = [](int row, int column) {
        return std::array<double, 2>{row / 40.0, column / 6.0};
      };
      grid.material = [](int, int) { return index(CarMaterial::rubber); };
      Mesh part;
      add_grid(part, wiper, grid);
      smooth_normals(part);
      append_mesh(mesh_, part);
    }
  }

  static constexpr double well_y = 0.54;          // of the wall behind a wheel
  static constexpr double bonnet_front_x = 1.80;  // its shut line

  CarShape shape_;
  SmoothSurface band_, deck_, cabin_;
  Mesh mesh_;
  std::vector<CoveredArea> band_cuts_, cabin_cuts_;
  std::vector<double> seams_;
};

}  // namespace

Mesh make_car_body() { return BodyMaker().make(); }

}  // namespace render
