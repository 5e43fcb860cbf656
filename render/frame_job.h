// What one frame is rendered from: a value without pointers, which can travel to another machine.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "calibrate/pose.h"
#include "capture/frame.h"
#include "capture/half.h"
#include "render/colour_matrix.h"
#include "render/light_table.h"
#include "render/ray_counts.h"

namespace render {

// All settings of speed against accuracy.
struct Effort {
  int aa_samples = 16;  // camera rays in pixels where an edge passes; 1 = no anti-aliasing
  // Standard error, in radiance, that a pixel of further camera rays may have before it takes four
  // times as many, and again, up to 1,024: of the first aa_samples half of this, and twice as much
  // each time. 0 = aa_samples must do.
  float aa_tolerance = 0.05F;
  // Radiance by which the virtual light of neighbouring pixels may differ, beside what one
  // surface's textures differ by, before they are sampled like edges, where it is 1 or more; below,
  // by the root of the radiance less. 0 = it never matters.
  float glint_contrast = 0.09F;
  int light_samples = 64;  // lights in the table
  int interleave = 1;  // 1, 2 or 4: each pixel of a block of this size tests its share of lights
  bool adaptive_visibility = true;  // shadow rays on every fourth pixel, more only at penumbrae
  // Virtual point lights, which stand for light between dull surfaces (BouncedLight); 0 = none is.
  int bounce_lamps = 0;
  int caustic_photons = 0;  // from bright lights through clear bodies (Caustics); 0 = straight on
  // Pixels look for wide lights all over the regions that these stand for, and share what they
  // find: soft shadows instead of steps.
  bool soft_lights = true;
  bool cull_lights = true;  // skip shadow rays that no object can block
  float accuracy = 0.97F;   // rays whose share of the pixel falls below 1 - accuracy are cut
  // Russian roulette: of rays that would be cut, some are followed and stand for all of them, by
  // chance. Right in the mean of many samples, and nearer than any cut where glass and mirrors face
  // each other.
  bool chance_cuts = false;
  bool dark_cuts = false;  // cut rays see nothing, instead of the environment: for charts
  int max_depth = 64;      // safety net; counted when hit
  int max_rays = 262144;   // that surfaces send on for a pixel; another safety net
  int tile_size = 32;      // pixels, a multiple of 16
  friend bool operator==(const Effort&, const Effort&) = default;
};

struct TextureTime {
  std::uint32_t stream = 0;
  capture::Time time{};
  friend bool operator==(const TextureTime&, const TextureTime&) = default;
};

struct FrameJob {
  std::int64_t frame = 0;
  capture::Time time{};
  calibrate::Pose cam_from_set;
  std::uint32_t lens = 0;
  std::uint64_t scene_version = 0;
  Effort effort;
  std::vector<TextureTime> textures;  // [0] is the plate, [1] the environment
  LightTable lights;
  ColourMatrix match = same_colours;  // probe radiance to plate units, already in `lights`
  // How fine each cell is, row by row (refinement.h); none = all of them as the effort asks.
  std::vector<std::uint8_t> stages;
  std::array<float, 2> tone{1, 0};  // of the display's curve: p and the brightest, 0 = none
  friend bool operator==(const FrameJob&, const FrameJob&) = default;
};

std::vector<std::byte> serialize(const FrameJob& job);
// Throws std::runtime_error on bytes that no serialize() wrote.
FrameJob parse_frame_job(std::span<const std::byte> bytes);

struct Rect {
  int x = 0, y = 0, width = 0, height = 0;
  friend bool operator==(const Rect&, const Rect&) = default;
};

// A part of the frame: a union of 16x16 cells (clipped by the picture), with its background.
struct TileJob {
  Rect rect;
  int margin = 0;                         // of background around rect, clipped by the picture
  Rect background_rect;                   // rect grown by margin, clipped
  std::vector<capture::Half> background;  // (background_rect.height, .width, 3)
  friend bool operator==(const TileJob&, const TileJob&) = default;
};

std::vector<std::byte> serialize(const TileJob& tile);
TileJob parse_tile_job(std::span<const std::byte> bytes);

struct RenderStatistics {
  std::uint64_t primary_rays = 0;
  std::uint64_t shadow_rays = 0;
  std::uint64_t secondary_rays = 0;
  std::uint64_t kept_rays = 0;         // that transport kept from earlier frames stands for
  std::uint64_t depth_limit_hits = 0;  // rays that max_depth ended
  std::uint64_t ray_limit_hits = 0;    // and those that max_rays did
  std::uint64_t clamped_values = 0;    // outputs beyond half, or not finite, made finite
  std::uint64_t clipped_plate = 0;     // stand-in pixels whose plate is clipped
  std::uint64_t virtual_pixels = 0;    // with A > 0
  std::uint64_t affected_pixels = 0;   // whose plate a stand-in changed, or with A > 0

  RenderStatistics& operator+=(const RenderStatistics& other);
  friend bool operator==(const RenderStatistics&, const RenderStatistics&) = default;
};

struct TileResult {
  Rect rect;
  std::vector<capture::Half> rgba;   // (rect.height, rect.width, 4): finished picture, coverage
  std::vector<capture::Half> matte;  // (rect.height, rect.width)
  std::vector<RayCount> rays;        // (rect.height, rect.width), or empty if not asked for
  RenderStatistics statistics;
};

}  // namespace render
