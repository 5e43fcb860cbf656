// What live pictures do in a frame to a cell that was found without them: before it, in what its
// surfaces mirror, and in its light. Private to the kernel.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/cell_squares.h"
#include "render/cell_transport.h"
#include "render/kernel.h"

namespace render {

// All memory that this takes on one thread; once it has grown, nothing is allocated.
class PictureLooker {
 public:
  // Of the cell whose top-left pixel is (x0, y0). False if they do nothing.
  bool look(const FrameContext& frame,
            const CellTransport& cell,
            int x0,
            int y0,
            CellPictures& seen,
            RenderStatistics& statistics);

 private:
  // Rays that look together, and who asks.
  struct Rays {
    int count = 0;
    alignas(64) std::array<float, stream_rays> ox, oy, oz, dx, dy, dz, far_m;
    alignas(64) std::array<float, stream_rays> width_m, cone_rad, red, green, blue;
    std::array<std::uint32_t, stream_rays> asker;

    void add(Vec3f from, Vec3f direction, float end_m, std::size_t number);
    SightRays sights() const;
  };

  bool passes_picture(Vec3f from, Vec3f direction, float far_m) const;
  template <class Footprint>
  void see(const Footprint& footprint);
  template <class Put>
  void put_together(Put&& put);
  void see_straight(const CellTransport& cell, CellPictures& seen);
  void see_along(const CellTransport& cell, CellPictures& seen);

  void aim(
      Vec3f from, Vec3f direction, float far_m, float width_m, float cone_rad, std::size_t number);
  template <class Take>
  void dim(Take&& take);
  void light_through(std::span<const CellTransport::PictureLight> all, std::vector<Vec3f>& passed);
  // Where centres look for a light: squares in whose corners alone they do, for its penumbra is
  // wider than these, and all others.
  struct ShadowPlan {
    std::array<std::uint8_t, all_squares> squares;  // their numbers
    std::size_t count = 0;
    CellMask pixels{};
  };
  bool is_soft_in(std::size_t bit,
                  const CellTransport::Shadowed& centres,
                  Vec3f direction,
                  float cone_rad) const;
  void plan_square(std::size_t bit,
                   const CellTransport::Shadowed& centres,
                   Vec3f direction,
                   float cone_rad,
                   ShadowPlan& plan) const;
  bool shade_centres(const CellTransport::Shadowed& centres,
                     const LitCentres& lit_centres,
                     const CellVisibility& visibility,
                     LostLight& lost);
  bool shade_lamps(const CellTransport::Shadowed& centres,
                   const CellLamps& lamps,
                   ColourPlanes& lost);
  bool look_for_light(const ShadowPlan& plan,
                      const CellTransport::Shadowed& centres,
                      Vec3f direction,
                      float cone_rad);

  // Of the cell at work.
  const FrameContext* frame_ = nullptr;
  RenderStatistics* statistics_ = nullptr;
  int x0_ = 0, y0_ = 0;
  Rays rays_;
  std::vector<Sight> sights_;
  ShadePoint point_;     // that a ray looks at
  ColourPlanes hidden_;  // of one light, from centres
};

}  // namespace render
