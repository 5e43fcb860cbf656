// Rays through a visual hull: where all keyed cameras that see a place see the person there.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "compositing/camera_grid.h"
#include "render/live_picture.h"

namespace compositing {

inline constexpr std::size_t most_hull_views = 8;

// Plain bytes, for parameter blocks.
struct MarchView {
  std::uint32_t picture;
  std::uint32_t first_byte;  // of its places among all of them
  float px_per_tangent;      // at the picture's middle
  calibrate::Vec3f position;
  CameraGrid camera;
};
struct HullBlock {
  std::uint32_t views;
  std::uint32_t hides;
  float step_px;
  std::array<float, 3> gain;
  std::array<MarchView, most_hull_views> view;
};

// A ray with the width of its cone where it begins, and by how much it grows.
struct HullRay {
  calibrate::Vec3f origin, direction;  // unit
  float width_m = 0, width_per_m = 0;
};

// The alpha of a place is the least that it has in the pictures of all cameras that see it; 0 if
// none does. Neither allocates nor throws; pictures must not be null.
class HullMarch {
 public:
  HullMarch(const HullBlock& block,
            std::span<const std::byte> places,
            std::span<const std::shared_ptr<const render::LivePicture>> pictures)
      : block_(block), places_(places), pictures_(pictures) {}

  struct Crossing {
    float alpha = 0;  // the largest on the way
    float at_m = 0;   // where it first has half of that
    float far_m = 0;  // nothing beyond was looked at
  };
  // Follows the ray from `from_m` to `to_m`, and no further than to what is as good as opaque,
  // which counts as 1. Steps are no longer than the block's in the picture that is nearest, times
  // `coarser`; what a picture says is empty is passed at once (LivePicture::most_alpha).
  Crossing find(const HullRay& ray, float from_m, float to_m, float coarser = 1) const;

  // What a camera sees at a place, in a square so wide; nothing if it does not see that far.
  std::optional<std::array<float, 4>> look(std::size_t view,
                                           calibrate::Vec3f p_set,
                                           float width_m) const;

 private:
  // The ray in the cameras' frames: begin + t * along.
  struct Lines {
    std::array<calibrate::Vec3f, most_hull_views> begin, along;
    float width_m = 0, width_per_m = 0;
  };
  struct Place {
    GridPlace place;
    float width_uv = 0;  // of the ray's cone
  };
  std::optional<Place> place_at(const Lines& lines, std::size_t view, float t) const;
  float alpha_at(const Lines& lines, float t, float least) const;
  float most_between(std::size_t view,
                     const std::optional<Place>& first,
                     const std::optional<Place>& middle,
                     const std::optional<Place>& last) const;
  int levels_of(const Lines& lines, float from, float to, float coarser) const;
  std::span<const std::byte> places_of(std::size_t view) const {
    return places_.subspan(block_.view[view].first_byte);
  }

  const HullBlock& block_;
  std::span<const std::byte> places_;
  std::span<const std::shared_ptr<const render::LivePicture>> pictures_;
};

}  // namespace compositing
