// The table of lights from frame to frame, without flicker.
#pragma once

#include <vector>

#include "render/light_regions.h"

namespace render {

struct LightFollowerSettings {
  LightTableSettings table;
  // Energies are averaged over about this many frames, or over fewer where they drift by more than
  // their noise; 1 = every frame for itself.
  float smoothing_frames = 12;
  // Directions are made anew when the light has moved this far from them, in the energy-weighted
  // mean.
  float tolerance_rad = 0.01F;
  // Relative change of a light's energy in any channel, or of all light by half of it, that is
  // taken for a change of the light and not for noise: its averaging starts anew.
  float sudden_change = 0.3F;
};

// Follows the light of a show. Directions stay frozen while the light stays where it is, so that
// what was found about their shadows stays true; energies follow each frame. Where three tenths of
// the light are elsewhere than when directions were made, as when a lamp goes off that had most of
// them, they are made anew: at once where light was calm for twelve frames, else, as under a lamp
// that blinks, once that has lasted for twelve. The state is all memory that the table has: it
// lives with the show, not with a kernel.
class LightFollower {
 public:
  // The table of the next frame. Its version grows when directions or planned irradiances change. A
  // black frame gives an empty table, and directions wait. Throws as make_light_table().
  LightTable follow(const Environment& env, const LightFollowerSettings& settings);
  // Where the lights that the last table marks as compact lie: the brightest of bright sources. To
  // be left out of the environment's smoothed levels, else their light counts twice.
  const CompactTexels& compact_texels() const { return compact_; }

 private:
  // A light with its averaged energy, and what tells a drift of it from noise: the newest energy,
  // by how much the average has missed of late, and the noise's variance; of its luminance.
  struct Followed {
    DirectionalLight light;
    std::array<double, 3> irradiance{};
    double newest = 0;
    double miss = 0;
    double variance = 0;
  };

  std::vector<RegionLight> make_anew(const Environment& env, const LightTableSettings& settings);
  void mark_compact();
  bool has_moved(const std::vector<RegionLight>& sums, float tolerance_rad) const;
  bool has_shifted(const std::vector<RegionLight>& sums);
  void take_energies(const std::vector<RegionLight>& sums, const LightFollowerSettings& settings);
  void plan();
  static double gain_of_drift(Followed& followed, double now);

  capture::Image map_;
  LightRegions regions_;
  std::vector<RegionParts> parts_;
  CompactTexels compact_;
  LightTableSettings made_with_;
  int made_height_ = 0;  // of the environment
  std::vector<Followed> lights_;
  int averaged_frames_ = 0;
  std::vector<double> cut_shares_;  // of the light, when regions were cut
  int calm_frames_ = 0;             // in a row whose shares are about those
  int shifted_frames_ = 0;          // in a row whose shares are others
  std::uint64_t version_ = 0;
};

}  // namespace render
