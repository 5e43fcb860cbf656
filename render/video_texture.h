// Live video as textures: a frame in scene-linear light with its mip levels, made once per frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "calibrate/vec.h"
#include "capture/colour.h"
#include "capture/image.h"
#include "render/area_footprint.h"

namespace render {

using calibrate::Vec3f;

// Immutable once made, so that all of a picture sees one video frame.
struct VideoTexture {
  // (height, width, 3), or 4 with premultiplied alpha. Level k is max(1, width >> k) by max(1,
  // height >> k), down to 1x1; each is the area average of the one before.
  std::vector<capture::Image> levels;
  std::int64_t not_numbers = 0;  // values that were not finite: they count as 0

  int width() const { return levels.empty() ? 0 : levels.front().width; }
  int height() const { return levels.empty() ? 0 : levels.front().height; }
};

// What is decided by the radiance of a video takes it for an even grey of this, so that it stays
// while the video runs.
inline constexpr float planned_grey = 0.5F;

// How texels are packed, row 0 on top, without padding; words are little-endian.
enum class VideoFormat : std::uint8_t {
  rgb565,     // 16 bits, red in the highest
  rgb8,       // codes of a transfer curve
  rgba8,      // the same with straight alpha
  rgbe,       // radiance: see capture/rgbe.h
  rgb_half,   // scene-linear
  rgba_half,  // scene-linear, premultiplied
};
inline constexpr std::size_t video_formats = 6;

struct PackedFrame {
  VideoFormat format = VideoFormat::rgb8;
  int width = 0;
  int height = 0;
  std::span<const std::byte> texels;
  capture::Transfer transfer = capture::Transfer::rec1886;  // of 565 and 8 bit codes
};

// Widest and highest frame that is accepted.
inline constexpr int largest_video_side = 16384;
// Throws std::invalid_argument for sides that are not 1 to that.
void check_video_size(int width, int height);

// The texture of a frame, scene-linear as capture delivers it, (height, width, 3 or 4). A texture
// that is made again keeps its memory. Values that are not finite become 0 and are counted; those
// beyond 1e9 are taken as that. Throws std::invalid_argument for an empty frame, another number of
// channels, or a side over largest_video_side.
void make_video_texture(const capture::Image& frame, VideoTexture& texture);
VideoTexture make_video_texture(const capture::Image& frame);
// The same of packed texels, decoded before they are filtered. Throws also if the number of bytes
// does not fit.
VideoTexture make_video_texture(const PackedFrame& frame);

// Where a filtered look-up finds a texture's light: share * level at (x, y) in its texels.
struct VideoSample {
  std::uint32_t level;
  float x, y, share;
};
inline constexpr int most_along_video = 4;
inline constexpr std::size_t most_video_samples = 2 * most_across * most_along_video;

// The places of a look-up at (u, v), 0..1 from the picture's top left, into a video of this size;
// its outermost texels go on beyond: those of footprint_grid(), up to most_along_video along its
// longer side. `blur_uv`: how wide the texels of a level are that does for a rough lobe, if they
// are as wide as the footprint, on a surface that shows the picture undistorted. Returns how many.
// What is not finite counts as 0.
std::size_t find_video_samples(int width,
                               int height,
                               float u,
                               float v,
                               const UvFootprint& footprint,
                               float blur_uv,
                               std::array<VideoSample, most_video_samples>& samples);

// A square so wide on a surface that shows a picture of this size undistorted.
UvFootprint undistorted_square(int width, int height, float width_uv);

// Light at (u, v), filtered so.
Vec3f sample(const VideoTexture& texture, float u, float v, float footprint_uv);

// Mean light over the part u0..u1, v0..v1 of the picture, 0..1, to a fraction of a texel of the
// level in which the part is 4 to 8 texels wide. Means over parts that tile the picture have its
// mean.
Vec3f mean_over(const VideoTexture& texture, float u0, float v0, float u1, float v1);

}  // namespace render
