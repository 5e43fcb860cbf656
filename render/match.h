// The gain that brings the lightprobe's radiance to the plate's units.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "render/colour_matrix.h"
#include "render/environment.h"

namespace render {

struct MatchResult {
  std::array<float, 3> gain{1, 1, 1};  // plate = gain * probe, per channel
  std::optional<ColourMatrix> matrix;  // in its place; then `gain` is that of greys
  double exposure = 1;                 // of the plate, over that of a given match: in both
  std::array<float, 3> implied_albedo{0, 0, 0};  // of the patch that was looked at; 0 = none was
  int pixels = 0;                                // of the plate that the gain rests on; 0 = on none
  double spread = 0;      // relative robust standard deviation of what was averaged
  std::string note;       // what was done, or why not, in words
  bool doubtful = false;  // then the note says why
};

// Directions or things that disagree by more than this, relative, have a common cause for it.
inline constexpr double doubtful_spread = 0.3;

struct MatchSettings {
  float clipped = 0.98F;   // plate values from here on say nothing
  float darkest = 0.005F;  // neither do plate values below this
  // What becomes of the gain where nothing tells it, for the note.
  std::string else_gain = "gain left at 1";
};

// A texel of the environment that both cameras see.
struct OverlapTexel {
  std::array<float, 3> plate{};  // mean of its pixels
  std::array<float, 3> probe{};  // its radiance
  int pixels = 0;                // of the plate
  std::size_t texel = 0;         // of the environment, row by row
};

// Texels that a whole plate tells, neither clipped nor dark, and that the probe saw. Both are taken
// to look at things far away. Throws as match_by_overlap.
std::vector<OverlapTexel> find_overlap(const capture::Image& plate,
                                       const calibrate::DirectionTable& plate_directions,
                                       const calibrate::Pose& cam_from_set,
                                       const Environment& env,
                                       const MatchSettings& settings = {});

// From the directions that both cameras see: the median over the environment's texels of plate over
// probe, where a whole texel of the plate is neither clipped nor dark. Both are taken to look at
// things far away. `env` is the probe's at gain 1. Without a common direction, gain stays 1 and the
// note says so. Throws std::invalid_argument if the plate is not of the table's size with 3
// channels.
MatchResult match_by_overlap(const capture::Image& plate,
                             const calibrate::DirectionTable& plate_directions,
                             const calibrate::Pose& cam_from_set,
                             const Environment& env,
                             const MatchSettings& settings = {});

// A part of the plate, in its pixels.
struct Patch {
  int x = 0, y = 0, width = 1, height = 1;
};

// From a matt patch of stated albedo per channel, lit by `irradiance` (irradiance_of() with the
// patch's normal, at gain 1): gain = (pi * plate / albedo - filled) / irradiance, `filled` being
// irradiance in the plate's units that no gain changes, of a floor filled in from the plate. Throws
// std::invalid_argument if the patch leaves the plate or an albedo is not above 0 and at most 1. A
// patch that is clipped, dark, unlit, or lit enough by `filled` alone, leaves the gain at 1, and
// the note says so.
MatchResult match_by_patch(const capture::Image& plate,
                           const Patch& patch,
                           std::array<float, 3> albedo,
                           Vec3f irradiance,
                           const MatchSettings& settings = {},
                           Vec3f filled = {});

// Why the light on a patch is to be doubted, of which the probe sees that share (SplitIrradiance);
// "" if it sees a half of it or more.
std::string doubt_of_patch(float seen_share);

// A given gain, or matrix, of a plate whose exposure is another by this factor.
MatchResult match_given(std::array<float, 3> gain, double exposure = 1);
MatchResult match_by_matrix(const ColourMatrix& matrix, double exposure = 1);

// Either of a result's.
ColourMatrix matrix_of(const MatchResult& match);

// Sets the result's implied albedo of a patch: pi * plate / (gain * irradiance), irradiance at
// gain 1. Throws as match_by_patch.
void imply_albedo(const capture::Image& plate,
                  const Patch& patch,
                  Vec3f irradiance,
                  MatchResult& result,
                  const MatchSettings& settings = {});

}  // namespace render
