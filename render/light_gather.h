// Irradiance from the light table at batches of points: who sees which light. Private to the
// kernel.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/cell_visibility.h"
#include "render/frame_job.h"
#include "render/lamp_way.h"
#include "render/ray_log.h"
#include "render/scene.h"
#include "render/shadow_answers.h"
#include "render/trace.h"

namespace render {

inline constexpr int stream_rays = 256;  // rays that go to Embree at once

// Numbers the surfaces of a few points, in the order in which they first appear.
class SurfaceNumbers {
 public:
  void clear() { count_ = 0; }
  // At most cell_pixels different ones. Neighbours mostly show the one that came last.
  std::uint32_t of(Scene::Surface surface) {
    for (std::uint32_t n = count_; n-- > 0;) {
      if (seen_[n] == surface) return n;
    }
    seen_[count_] = surface;
    return count_++;
  }

 private:
  std::array<Scene::Surface, cell_pixels> seen_;
  std::uint32_t count_ = 0;
};

// Up to 256 points that receive light, as structure of arrays. In a grid, entry y * 16 + x is the
// pixel (x, y) of a cell, and idle entries are those without a receiver.
struct Receivers {
  alignas(64) std::array<float, cell_pixels> px, py, pz;  // shadow ray origins, off the surface
  alignas(64) std::array<float, cell_pixels> nx, ny, nz;  // shading normal
  alignas(64) std::array<float, cell_pixels> gx, gy, gz;  // geometric normal
  LightSums light;                                        // out
  // Same number = same object and material; below 256.
  std::array<std::uint32_t, cell_pixels> surface;
  SurfaceNumbers surfaces;
  std::array<std::uint32_t, cell_pixels> mask;  // what blocks: mask_virtual, mask_real_blocker
  std::array<std::uint8_t, cell_pixels>
      real_first;  // light that real things block does not count as open
  // Part of wide lights that it looks for; in a grid, that of its pixel.
  std::array<std::uint8_t, cell_pixels> part;
  // Of the pixel: weak points test fewer lights, those of 0 only the compact ones.
  std::array<float, cell_pixels> share;
  std::array<std::uint64_t, 4> active;    // bit y % 4 * 16 + x of word y / 4
  std::array<std::uint64_t, 4> by_lamps;  // of these, those that lamps matter to
  // Those that caustics light: to them light does not go straight through clear bodies.
  std::array<std::uint64_t, 4> by_caustics;
  int count = 0;          // of entries, if not a grid
  bool mirrored = false;  // a grid of what centres mirror: each is asked for compact lights
};

// The least cosine between normals of one smooth surface, from pixel to pixel.
inline constexpr float alike_normals = 0.93F;

// The places i * this, less what is whole of them, lie evenly in 0..1 for any count of them.
inline constexpr float golden_ratio = 0.6180340F;

// A point that counts less of its pixel tests one light of four, or of eight.
inline constexpr float few_lights_share = 0.2F;

// Structure of arrays of one stream of shadow rays, and scratch of one gather.
struct GatherWorkspace {
  alignas(64) std::array<float, stream_rays> ox, oy, oz, dx, dy, dz, near_m, far_m, time;
  alignas(64) std::array<unsigned, stream_rays> mask, id, flags;
  alignas(64) std::array<float, stream_rays> tr, tg, tb;  // transmittance so far
  std::array<float, stream_rays> reach_m;  // far_m before they were shot, if `notes` ask for it
  std::array<std::uint32_t, stream_rays> ray_light, ray_point;
  std::array<float, stream_rays> ray_weight;  // of callers who want one back
  int rays = 0;
  RayLog* log = nullptr;                      // keeps all rays, if set
  std::uint32_t* counts = nullptr;            // adds up shadow rays by receiver, if set
  LivePictures pictures = LivePictures::met;  // that block light
  ShadowNotes notes;

  static constexpr int group = 64;  // lights at a time
  std::array<CellMask, group> lit, seen, tested, near;
  struct Tint {
    std::uint32_t light, point;
    Vec3f lost_share;
  };
  // Lights that points are to test.
  struct Asked {
    std::uint16_t point, light;
    float weight;  // see PointLight
  };
  std::vector<Asked> asked, asked_by_light;
  std::vector<LampWay<Eight>> ways;  // to each lamp, of eight points
  std::vector<float> gives;          // of a row of lights: what each gives a point, 0 below it
  std::vector<std::size_t> first_of_light;
  std::vector<Tint> tints;  // light that glass weakened, capacity reserved
  LightSums soft;
  // What is so near to a centre, times the radius of a light, casts penumbrae narrower than pixels
  // can share.
  std::array<float, cell_pixels> sharp_m{};
  CellMask same2;  // pixels whose 2x2 block is one smooth surface
  // A smooth surface, or what of it lies in a 4x4 block.
  struct Region {
    std::uint64_t pixels;       // of a word
    std::uint64_t outermost;    // of these, those where the surface ends, or the cell does; none if
                                // it is all of the block
    CellMask beside;            // regions of the same surface in this block and those about it
    CellMask alike;             // and in all of the cell
    std::uint8_t word, column;  // of the block
    std::uint8_t ends;          // sides on which the surface ends with a block that is all of it
    bool whole;                 // it is all of the block
  };
  std::array<Region, cell_pixels> regions;
  std::size_t region_count = 0;
};

class Caustics;

// The table's lights side by side: those that are not compact in the order of their places in the
// sky, then the compact ones; rows of floats filled up to whole eights with some that shine
// nowhere.
struct LightRows {
  LightRows() = default;
  explicit LightRows(std::span<const DirectionalLight> lights);
  std::vector<std::uint16_t> number;  // in the table
  std::vector<std::uint16_t> place;   // and back: of each light of the table, where in these
  std::vector<float> x, y, z;         // of directions
  std::vector<float> sum;             // of the irradiance's colours
  std::vector<float> spread;          // DirectionalLight::spread
  std::size_t wide = 0;               // so many are not compact
};

// What every cell of a frame shares.
struct LightContext {
  const Scene* scene = nullptr;
  const LightTable* table = nullptr;
  const Effort* effort = nullptr;
  const Caustics* caustics = nullptr;  // whose lights follow the table's own lamps, or null
  std::size_t first_caustic = 0;       // of the lamps
  const SoftLights* parts = nullptr;   // null: all lights are looked for in their middle
  const LightRows* rows = nullptr;

  bool is_caustic(std::size_t lamp) const { return caustics != nullptr && lamp >= first_caustic; }
  // What shadow rays to a light of the table carry in their mask beside what blocks them.
  unsigned mask_to(std::uint32_t light) const;
  bool has_parts(std::size_t light) const { return parts != nullptr && parts->has(light); }
  // Within which all directions lie in which a light is looked for.
  DirectionRange range(std::size_t light) const {
    const Vec3f middle = table->lights[light].direction;
    return has_parts(light) ? parts->range(light) : DirectionRange{middle, middle};
  }
  // Whether anything may be in a light's way from that box.
  bool can_be_blocked(const Scene::Bounds& from, std::size_t light) const;
  // Towards a light from a receiver: to the part that it looks for, or to the middle, if that part
  // has set there.
  Vec3f direction(const Receivers& r, std::size_t point, std::uint32_t light) const {
    const Vec3f middle = table->lights[light].direction;
    if (!has_parts(light) || r.part[point] == SoftLights::middle) return middle;
    const Vec3f to = parts->direction(light, r.part[point]);
    return r.gx[point] * to.x + r.gy[point] * to.y + r.gz[point] * to.z > 0 ? to : middle;
  }
};

// Finds what the pixels of a cell see, and adds up their light. Shadow rays go to
// one pixel of every 4x4 block of a smooth surface first, another for each light, but an outermost
// one at the cell's border and where the surface ends beside the block, and to two of
// lights that are compact or have parts, and of surfaces that end on both sides; where surfaces
// meet in a block, to two pixels of each, but of all for lights that are compact or have parts.
// Where these disagree with their surface's in the blocks around, to their 2x2 blocks or pixels, as
// the effort's interleave asks; for lights that have parts, all over the surface.
void gather_cell(const LightContext& context,
                 Receivers& receivers,
                 GatherWorkspace& workspace,
                 CellVisibility& visibility,
                 RenderStatistics& statistics);

// A light that was tested at a point.
struct PointLight {
  std::uint16_t point, light;
  float weight;  // the cosine, times the light that this one stands for
  Vec3f passed;  // share of its light that arrives
};

// The same for any points, tested lights appended to `tested`: every point tests every light, or,
// where its share of the picture is small and the effort allows it, one of every two, four ... that
// lie side by side in the sky. That one stands for the others as if it were as bright as all of
// them: the brightest at the point; of many samples of a pixel, each takes one by what it gives
// there.
void gather_points(const LightContext& context,
                   Receivers& receivers,
                   GatherWorkspace& workspace,
                   std::vector<PointLight>& tested,
                   RenderStatistics& statistics);

// What a cell's centres get of the table's lamps: for each that reaches any of them, irradiance per
// intensity, 0 where it is hidden.
struct CellLamps {
  struct alignas(64) Factors {
    std::array<float, cell_pixels> at;
  };
  std::vector<std::uint16_t> numbers;  // of the lamps
  std::vector<Factors> factors;        // of each of them
  std::vector<TintedLight> tints;      // `light` is a place in `numbers`; sorted by key_of

  // Of the lamp at a place in `numbers`; and what passes of it to a centre that it reaches.
  std::span<const TintedLight> tints_of(std::size_t place) const;
  Vec3f passed(std::size_t place, std::size_t centre) const;
};

// Finds that, for the points of Receivers::by_lamps, with shadow rays as in gather_cell. Whatever
// it is, virtual or real, blocks a lamp.
void gather_cell_lamps(const LightContext& context,
                       const Receivers& receivers,
                       GatherWorkspace& workspace,
                       CellLamps& lamps,
                       RenderStatistics& statistics);

// A lamp that reaches a point.
struct PointLamp {
  std::uint16_t point, lamp;
  Vec3f passed;  // share of its light that arrives; of a caustic, irradiance per intensity
  float open;    // irradiance per intensity, were nothing in the way; of a caustic, 1
  Vec3f factor() const { return passed * open; }
};

// The same for any points, point by point, appended to `reached`: every point tests every lamp.
void gather_point_lamps(const LightContext& context,
                        const Receivers& receivers,
                        GatherWorkspace& workspace,
                        std::vector<PointLamp>& reached,
                        RenderStatistics& statistics);

}  // namespace render
