// From the picture of a lightprobe camera to the light of the set.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "render/colour_matrix.h"
#include "render/environment.h"
#include "render/probe_gather.h"

namespace render {

struct ProbeSettings {
  int height = 256;  // of the environment
  Unseen unseen = Unseen::floor;
  float floor_albedo = 0.2F;  // of Unseen::floor
  // The lens's terms (calibrate/vignetting.h); empty = even. Radiance is divided by its
  // sensitivity.
  std::vector<double> vignetting{};
};

// What belongs to one frame.
struct ProbeFrame {
  ColourMatrix match = same_colours;  // probe radiance to plate units
  std::optional<Vec3f>
      floor_radiance;  // Unseen::floor: the plate's mean colour instead of an albedo
};

// Maps pictures of one probe camera to environments. Made once per camera. Not thread-safe; uses
// oneTBB.
//
// Each texel takes the mean of the probe's pixels over its solid angle, and each pixel gives its
// light times its solid angle, so that an even picture stays even, and a sun keeps its energy
// however few pixels it has. Texels that are seen by less than half are filled:
//   floor   as a floor that the seen light from above shines on
//   mirror  as the seen directions mirrored at the plane through the lens's rim, else as `mean`
//   mean    as the mean of all that is seen, without what is more than 4 times as bright as the
//   mean:
//           the unseen side has walls and sky too, but hardly a second sun or window
class ProbeMapper {
 public:
  // Throws std::invalid_argument: a lens that is none, a height that is not from 8 to 4096, a
  // vignetting that reaches 0, an albedo outside 0..1, or a lens that sees nothing.
  ProbeMapper(const calibrate::Lens& lens,
              const calibrate::Pose& probe_from_set,
              const ProbeSettings& settings);

  // `probe` is scene-linear, (lens.height, lens.width, 3); NaN and negative values count as 0.
  // Fills radiance, seen and unseen_share of `out`; smooth_for_reflections() comes after. Allocates
  // nothing if `out` came from here before. Throws std::invalid_argument for a picture of another
  // size.
  void map(const capture::Image& probe, const ProbeFrame& frame, Environment& out);

  // Texels of the last map() that its match took below 0; they count as 0.
  int texels_below_zero() const;

  // The part of the sphere that the probe sees, 0..1.
  double seen_part() const;

 private:
  // What a row of one frame adds up to: radiance of seen and of filled texels.
  struct RowSum {
    std::array<double, 3> seen{}, filled{};
    int below_zero = 0;
  };

  void correct_vignetting(const calibrate::Lens& lens);
  void find_mirrored(const calibrate::Pose& probe_from_set);
  void shrink(const capture::Image& probe);
  void gather_row(int row, const ProbeFrame& frame, Environment& out);
  Vec3f mean_without_sources(const Environment& env) const;
  Vec3f floor_of_light_from_above() const;
  void fill_row(int row, Vec3f fill, Environment& out);
  float unseen_share() const;

  int width_, height_;  // of the probe's picture
  ProbeSettings settings_;
  ProbeGather gather_;     // weights divided by the vignetting
  capture::Image shrunk_;  // the picture as it counts, shrunk, 4 channels to load at once
  std::vector<std::uint8_t> seen_;
  std::vector<std::int32_t> mirrored_;  // Unseen::mirror: per texel, the seen texel to copy, or -1
  std::vector<int> seen_in_row_;
  std::vector<RowSum> row_sums_;
};

}  // namespace render
