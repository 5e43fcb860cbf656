// Lamps, grille, plates and windows of the made car.
#include "render/made_car_trim.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "render/made_car.h"

namespace render {
namespace {

using Corners = std::vector<std::array<double, 2>>;

class TrimMaker {
 public:
  explicit TrimMaker(const CarShape& shape) : shape_(shape) {
    band_ = [this](double way, double z) { return shape_.band(way, z); };
    cabin_ = [this](double foot_x, double share) { return shape_.cabin(foot_x, share); };
  }

  CarTrim make() {
    lay_front();
    lay_rear();
    lay_windows();
    return std::move(trim_);
  }

 private:
  // A patch on the band, and its mirror image; what lies under it is left out.
  void lay_on_band(const Corners& corners,
                   CarMaterial material,
                   double lift_m,
                   bool both_sides,
                   int rings,
                   int points,
                   CarMaterial rim = CarMaterial::seam) {
    const ParameterLine line = lay(corners, material, lift_m, both_sides, rings, points, rim,
                                   std::exchange(laid_over_, {}));
    trim_.on_band.emplace_back(scaled(line, 0.985), both_sides);
  }
  // A patch that will lie on the next one of lay_on_band().
  void lay_over(const Corners& corners,
                CarMaterial material,
                double lift_m,
                bool both_sides,
                int rings,
                int points) {
    laid_over_.push_back(
        scaled(lay(corners, material, lift_m, both_sides, rings, points, material, {}), 0.985));
  }
  ParameterLine lay(const Corners& corners,
                    CarMaterial material,
                    double lift_m,
                    bool both_sides,
                    int rings,
                    int points,
                    CarMaterial rim,
                    std::vector<ParameterLine> covers) {
    LaidPatch patch;
    patch.line = make_rounded_line(corners, points);
    patch.lift_m = lift_m;
    patch.rings = rings;
    patch.material = index(material);
    patch.rim = index(rim);
    patch.covers = std::move(covers);
    Mesh part;
    add_laid(part, band_, patch);
    append_mesh(trim_.mesh, part);
    if (both_sides) add_mirrored(trim_.mesh, part);
    return patch.line;
  }

  void lay_front() {
    // Head lamps wrap around the corners.
    lay_over({{0.60, 0.562}, {0.68, 0.556}, {0.70, 0.590}, {0.69, 0.612}, {0.62, 0.604}},
             CarMaterial::head_lamp, 0.008, true, 5, 48);
    lay_over({{0.76, 0.572}, {0.84, 0.574}, {0.88, 0.608}, {0.85, 0.634}, {0.78, 0.624}},
             CarMaterial::head_lamp, 0.008, true, 5, 48);
    lay_over({{0.93, 0.582}, {0.99, 0.594}, {1.08, 0.655}, {1.05, 0.664}, {0.95, 0.598}},
             CarMaterial::head_lamp, 0.008, true, 4, 64);
    lay_on_band({{0.52, 0.545},
                 {0.66, 0.530},
                 {0.98, 0.572},
                 {1.15, 0.668},
                 {1.06, 0.690},
                 {0.80, 0.655},
                 {0.56, 0.610}},
                CarMaterial::lens, 0.004, true, 10, 120);
    // Grille between them, with bars and a badge.
    for (int i = 0; i < 3; ++i) {
      const double z = 0.527 + 0.024 * i;
      const double w = 0.42 - 0.015 * i;
      for (const double side : {-1.0, 1.0}) {
        Corners bar{{0.066 * side, z - 0.003},
                    {w * side, z - 0.003},
                    {w * side, z + 0.003},
                    {0.066 * side, z + 0.003}};
        if (side < 0) std::reverse(bar.begin(), bar.end());
        lay_over(bar, CarMaterial::chrome, 0.010, false, 3, 80);
      }
    }
    lay_over({{-0.055, 0.528}, {0.055, 0.528}, {0.055, 0.590}, {-0.055, 0.590}},
             CarMaterial::chrome, 0.013, false, 6, 64);
    lay_on_band({{-0.43, 0.505},
                 {0.43, 0.505},
                 {0.50, 0.560},
                 {0.44, 0.600},
                 {-0.44, 0.600},
                 {-0.50, 0.560}},
                CarMaterial::plastic, 0.004, false, 14, 160, CarMaterial::chrome);
    // Lower intake, fog lamps, number plate.
    lay_on_band({{-0.46, 0.245}, {0.46, 0.245}, {0.40, 0.345}, {-0.40, 0.345}},
                CarMaterial::plastic, 0.003, false, 8, 128);
    lay_over({{0.71, 0.295}, {0.79, 0.297}, {0.79, 0.340}, {0.71, 0.338}}, CarMaterial::head_lamp,
             0.008, true, 5, 40);
    lay_on_band({{0.64, 0.260}, {0.92, 0.275}, {0.95, 0.345}, {0.86, 0.375}, {0.66, 0.345}},
                CarMaterial::plastic, 0.003, true, 10, 80);
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
    lay_on_band(from_back({{0.42, 0.725},
                           {0.70, 0.700},
                           {1.00, 0.715},
                           {1.13, 0.790},
                           {0.98, 0.845},
                           {0.66, 0.840},
                           {0.44, 0.800}}),
                CarMaterial::lens, 0.004, true, 9, 104);
    lay_on_band(from_back({{-0.27, 0.560}, {0.27, 0.560}, {0.27, 0.655}, {-0.27, 0.655}}),
                CarMaterial::plate, 0.006, false, 6, 120, CarMaterial::plastic);
    lay_over(from_back({{0.40, 0.235}, {0.50, 0.235}, {0.50, 0.285}, {0.40, 0.285}}),
             CarMaterial::chrome, 0.012, false, 5, 48);
    lay_over(from_back({{-0.50, 0.235}, {-0.40, 0.235}, {-0.40, 0.285}, {-0.50, 0.285}}),
             CarMaterial::chrome, 0.012, false, 5, 48);
    lay_on_band(from_back({{-0.62, 0.215}, {0.62, 0.215}, {0.55, 0.330}, {-0.55, 0.330}}),
                CarMaterial::plastic, 0.003, false, 12, 128);
    lay_on_band(from_back({{-0.06, 0.740}, {0.06, 0.740}, {0.06, 0.800}, {-0.06, 0.800}}),
                CarMaterial::chrome, 0.008, false, 6, 56, CarMaterial::chrome);
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
    append_mesh(trim_.mesh, part);
    if (both_sides) add_mirrored(trim_.mesh, part);
    trim_.on_cabin.emplace_back(scaled(patch.line, 0.985), both_sides);
  }

  void lay_windows() {
    lay_on_cabin(
        {{0.24, 0.275}, {0.96, 0.200}, {0.985, 0.5}, {0.96, 0.800}, {0.24, 0.725}, {0.20, 0.5}},
        false, 176, 10);
    lay_on_cabin({{-1.70, 0.235},
                  {-1.22, 0.295},
                  {-1.19, 0.5},
                  {-1.22, 0.705},
                  {-1.70, 0.765},
                  {-1.735, 0.5}},
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
    lay_on_cabin({{-1.56, 0.060}, {-1.185, 0.042}, {-1.185, 0.212}, {-1.34, 0.190}}, true, 64, 5);
  }

  const CarShape& shape_;
  SmoothSurface band_, cabin_;
  CarTrim trim_;
  std::vector<ParameterLine> laid_over_;  // waits for the patch beneath
};

}  // namespace

CarTrim make_car_trim(const CarShape& shape) { return TrimMaker(shape).make(); }

}  // namespace render
