// The made car's body: band, deck, cabin, floor, arches, lamps, glass, trim.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "render/made_car.h"
#include "render/made_car_shape.h"
#include "render/surface_patches.h"

namespace render {
namespace {

constexpr double pi = std::numbers::pi;

std::uint32_t index(CarMaterial material) { return static_cast<std::uint32_t>(material); }

using Corners = std::vector<std::array<double, 2>>;

class BodyMaker {
 public:
  BodyMaker() {
    band_ = [this](double way, double z) { return shape_.band(way, z); };
    deck_ = [this](double x, double share) { return shape_.deck(x, share); };
    cabin_ = [this](double foot_x, double share) { return shape_.cabin(foot_x, share); };
  }

  Mesh make() {
    lay_front();
    lay_rear();
    lay_windows();
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
  // A patch on the band, and its mirror image; what lies under it is left out.
  void lay_on_band(const Corners& corners,
                   CarMaterial material,
                   double lift_m,
                   bool both_sides,
                   int rings = 8,
                   int points = 96,
                   CarMaterial rim = CarMaterial::seam) {
    LaidPatch patch;
    patch.line = make_rounded_line(corners, points);
    patch.lift_m = lift_m;
    patch.rings = rings;
    patch.material = index(material);
    patch.rim = index(rim);
    Mesh part;
    add_laid(part, band_, patch);
    append_mesh(mesh_, part);
    if (both_sides) add_mirrored(mesh_, part);
    band_cuts_.push_back({scaled(patch.line, 0.985), both_sides});
  }
  // The same on top of another patch, which stays whole beneath it (its edges show).
  void lay_over(const Corners& corners,
                CarMaterial material,
                double lift_m,
                bool both_sides,
                int rings,
                int points) {
    const std::size_t cuts = band_cuts_.size();
    lay_on_band(corners, material, lift_m, both_sides, rings, points, material);
    band_cuts_.resize(cuts);
  }

  void lay_front() {
    // Head lamps wrap around the corners.
    lay_on_band({{0.52, 0.545},
                 {0.66, 0.530},
                 {1.02, 0.575},
                 {1.22, 0.680},
                 {1.10, 0.695},
                 {0.80, 0.655},
                 {0.56, 0.610}},
                CarMaterial::lens, 0.004, true, 10, 128);
    lay_over({{0.60, 0.562}, {0.68, 0.556}, {0.70, 0.590}, {0.69, 0.612}, {0.62, 0.604}},
             CarMaterial::head_lamp, 0.008, true, 5, 48);
    lay_over({{0.76, 0.572}, {0.84, 0.574}, {0.88, 0.608}, {0.85, 0.634}, {0.78, 0.624}},
             CarMaterial::head_lamp, 0.008, true, 5, 48);
    lay_over({{0.93, 0.582}, {1.01, 0.596}, {1.13, 0.664}, {1.11, 0.672}, {0.95, 0.598}},
             CarMaterial::head_lamp, 0.008, true, 4, 64);
    // Grille between them, with bars.
    lay_on_band({{-0.43, 0.505},
                 {0.43, 0.505},
                 {0.50, 0.560},
                 {0.44, 0.600},
                 {-0.44, 0.600},
                 {-0.50, 0.560}},
                CarMaterial::plastic, 0.004, false, 10, 160, CarMaterial::chrome);
    for (int i = 0; i < 3; ++i) {
      const double z = 0.527 + 0.024 * i;
      const double w = 0.42 - 0.015 * i;
      lay_over({{-w, z - 0.003}, {w, z - 0.003}, {w, z + 0.003}, {-w, z + 0.003}},
               CarMaterial::chrome, 0.010, false, 3, 120);
    }
    lay_over({{-0.055, 0.528}, {0.055, 0.528}, {0.055, 0.590}, {-0.055, 0.590}},
             CarMaterial::chrome, 0.016, false, 6, 64);
    // Lower intake and fog lamps.
    lay_on_band({{-0.46, 0.245}, {0.46, 0.245}, {0.40, 0.345}, {-0.40, 0.345}},
                CarMaterial::plastic, 0.003, false, 8, 128);
    lay_on_band({{0.64, 0.260}, {0.92, 0.275}, {0.95, 0.345}, {0.86, 0.375}, {0.66, 0.345}},
                CarMaterial::plastic, 0.003, true, 7, 80);
    lay_over({{0.71, 0.295}, {0.79, 0.297}, {0.79, 0.340}, {0.71, 0.338}}, CarMaterial::head_lamp,
             0.008, true, 5, 40);
    lay_on_band({{-0.26, 0.385}, {0.26, 0.385}, {0.26, 0.475}, {-0.26, 0.475}}, CarMaterial::plate,
                0.006, false, 6, 120, CarMaterial::plastic);
  }

  void lay_rear() {
    const double back = shape_.length() / 2;
    const auto from_back = [back](Corners corners) {
      for (auto& corner : corners) corner[0] = back - corner[0];
      std::reverse(corners.begin(), corners.end());
      return corners;
    };
    lay_on_band(from_back({{0.42, 0.725},
                           {0.70, 0.700},
                           {1.00, 0.715},
                           {1.13, 0.790},
                           {0.98, 0.845},
                           {0.66, 0.840},
                           {0.44, 0.800}}),
                CarMaterial::lens, 0.004, true, 9, 120);
    lay_over(from_back({{0.47, 0.738},
                        {0.70, 0.716},
                        {0.96, 0.730},
                        {1.00, 0.760},
                        {0.70, 0.748},
                        {0.48, 0.766}}),
             CarMaterial::tail_lamp, 0.009, true, 5, 80);
    lay_over(from_back({{0.49, 0.782},
                        {0.70, 0.772},
                        {1.02, 0.785},
                        {0.96, 0.822},
                        {0.68, 0.820},
                        {0.50, 0.800}}),
             CarMaterial::tail_lamp, 0.009, true, 5, 80);
    lay_on_band(from_back({{-0.27, 0.560}, {0.27, 0.560}, {0.27, 0.655}, {-0.27, 0.655}}),
                CarMaterial::plate, 0.006, false, 6, 120, CarMaterial::plastic);
    lay_on_band(from_back({{-0.62, 0.215}, {0.62, 0.215}, {0.55, 0.330}, {-0.55, 0.330}}),
                CarMaterial::plastic, 0.003, false, 8, 128);
    lay_over(from_back({{0.40, 0.235}, {0.50, 0.235}, {0.50, 0.285}, {0.40, 0.285}}),
             CarMaterial::chrome, 0.012, true, 5, 48);
    lay_over(from_back({{-0.06, 0.740}, {0.06, 0.740}, {0.06, 0.800}, {-0.06, 0.800}}),
             CarMaterial::chrome, 0.008, false, 6, 56);
  }

  void lay_on_cabin(const Corners& corners, bool both_sides, int points, int rings) {
    LaidPatch patch;
    patch.line = make_rounded_line(corners, points);
    patch.lift_m = 0.0025;
    patch.rings = rings;
    patch.rim_rings = 2;
    patch.material = index(CarMaterial::glass);
    patch.rim = index(CarMaterial::plastic);
    Mesh part;
    add_laid(part, cabin_, patch);
    append_mesh(mesh_, part);
    if (both_sides) add_mirrored(mesh_, part);
    cabin_cuts_.push_back({scaled(patch.line, 0.985), both_sides});
  }

  void lay_windows() {
    lay_on_cabin(
        {{0.24, 0.275}, {0.96, 0.200}, {0.985, 0.5}, {0.96, 0.800}, {0.24, 0.725}, {0.20, 0.5}},
        false, 176, 10);
    lay_on_cabin({{-1.76, 0.235},
                  {-1.22, 0.295},
                  {-1.19, 0.5},
                  {-1.22, 0.705},
                  {-1.76, 0.765},
                  {-1.79, 0.5}},
                 false, 144, 9);
    // Side windows: front door with its corner, rear door, quarter light.
    lay_on_cabin({{-0.355, 0.040},
                  {0.82, 0.045},
                  {0.55, 0.130},
                  {0.16, 0.222},
                  {-0.02, 0.232},
                  {-0.355, 0.236}},
                 true, 128, 8);
    lay_on_cabin({{-1.13, 0.040}, {-0.435, 0.040}, {-0.435, 0.236}, {-0.80, 0.234}, {-1.13, 0.222}},
                 true, 96, 7);
    lay_on_cabin({{-1.60, 0.060}, {-1.185, 0.042}, {-1.185, 0.214}, {-1.36, 0.190}}, true, 64, 5);
  }

  // Whether all corners of a cell lie under a patch.
  struct Cut {
    ParameterLine line;
    bool both_sides;
  };
  template <class Reflect>
  static bool covered(const std::vector<Cut>& cuts,
                      const std::array<std::array<double, 2>, 4>& corners,
                      Reflect&& reflections) {
    return std::any_of(cuts.begin(), cuts.end(), [&](const Cut& cut) {
      const auto all_inside = [&](auto&& map) {
        return std::all_of(corners.begin(), corners.end(), [&](const auto& corner) {
          const auto [u, v] = map(corner);
          return lies_inside(cut.line, u, v);
        });
      };
      return reflections(cut.both_sides, all_inside);
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
    constexpr int rows = 37;
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
      add_grid(mesh_, deck_, grid);
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
      const bool sill = share < 0.034 && x > -1.62 && x < 0.88;
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

  static constexpr double well_y = 0.60;          // of the wall behind a wheel
  static constexpr double bonnet_front_x = 1.80;  // its shut line

  CarShape shape_;
  SmoothSurface band_, deck_, cabin_;
  Mesh mesh_;
  std::vector<Cut> band_cuts_, cabin_cuts_;
  std::vector<double> seams_;
};

}  // namespace

Mesh make_car_body() { return BodyMaker().make(); }

}  // namespace render
