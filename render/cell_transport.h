// How light gets from its sources to the pixels of a cell: all of a cell's picture but the light.
// Private to the kernel.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/cell_reach.h"
#include "render/environment.h"
#include "render/environment_terms.h"
#include "render/frame_job.h"
#include "render/light_gather.h"
#include "render/shader.h"

namespace render {

// Where a sample's light is added up: 0..255 the centre of a pixel, 256..511 all further samples of
// a pixel together.
inline constexpr std::size_t slots = 2 * cell_pixels;
static_assert(slots <= EnvironmentTerms::slots);

// What rays found out about a cell, as sums over the light: pixel = plate * share + light from the
// environment, from the table's lights, and of the surfaces themselves. It holds while scene,
// camera, lens, directions of lights and effort stay; lighting it anew takes no ray.
//
// After Sloan, Kautz and Snyder, "Precomputed Radiance Transfer for Real-Time Rendering in Dynamic,
// Low-Frequency Lighting Environments", SIGGRAPH 2002, but with the table's own lights as the
// basis, and with mirrored light as places in the environment.
struct CellTransport {
  struct Base {
    Vec3f radiance{};  // whatever the light
    Vec3f plate{};     // share of the plate
    float passed = 0;  // the same in the mean
    float seen = 0;    // 1 - coverage by virtual objects
    friend bool operator==(const Base&, const Base&) = default;
  };
  // Slot += weight * light of the table, or intensity of a lamp.
  struct LightTerm {
    std::uint16_t slot, light;
    Vec3f weight;
  };
  // Slot += weight * irradiance of a centre, or of what it mirrors; or the plate's share, as far as
  // the centre sees light.
  struct SharedTerm {
    enum class Of : std::uint8_t { light, mirrored_light, shadow };
    std::uint16_t slot, centre;
    Of of;
    Vec3f weight;
  };
  // What centres mirror, or see through something clear, where neighbours see one surface so: it
  // gets its light as centres do. 0 where there is none.
  struct Mirrored {
    alignas(64) std::array<float, cell_pixels> nx, ny, nz;
    ColourPlanes diffuse;  // radiance per irradiance, times its share
    std::array<std::uint16_t, cell_pixels> slot;
    bool any_shadow = false;  // any is the plate, in shadows
  };
  // Centres that receive light: normals and answers; 0 elsewhere.
  struct Centres {
    alignas(64) std::array<float, cell_pixels> nx, ny, nz;
    ColourPlanes diffuse;  // radiance per irradiance
    ColourPlanes shadow;   // plate's share, as far as light is seen
    bool any_diffuse = false, any_shadow = false;

    Vec3f normal(std::size_t k) const { return {nx[k], ny[k], nz[k]}; }
  };
  // A point of a stand-in that is no centre: the plate passes as far as it sees light.
  struct ShadowPoint {
    std::uint16_t slot;
    std::uint32_t first, count;  // of shadow_lights
    Vec3f share;
  };
  // What is lost of a light is nothing of it, all, or as a tint says. Of samples through glass
  // there are very many.
  struct ShadowLight {
    static constexpr std::uint16_t passes = 0, blocked = 1, first_tint = 2;
    std::uint16_t light, tint;  // of shadow_tints, from first_tint on
    float open;
  };
  // A stand-in's point that lamps shine on.
  struct LampCatcher {
    std::uint16_t slot;
    std::uint32_t point;  // a centre, or cell_pixels + a shadow point
    Vec3f share, albedo;
  };
  // Irradiance of a catcher that is at no centre += factor * intensity of a lamp.
  struct CaughtLamp {
    std::uint32_t catcher;
    std::uint16_t lamp;
    Vec3f factor;
  };
  // A term of the plate at a place that clear bodies or mirrors show, less what its point loses of
  // light.
  struct ShadedPlate {
    PlaceTerm term;
    std::uint32_t point;  // of shadow_points; or what a centre mirrors, first_mirrored + its pixel
    static constexpr std::uint32_t first_mirrored = 1U << 31;
  };
  // The plate of a shadow point that clear bodies show is brighter by factor * intensity of a lamp,
  // of the light that is there.
  struct BentCaustic {
    std::uint32_t point;
    std::uint16_t lamp;
    Vec3f factor;
  };
  // Slot += what live textures show at some places, which counts as 1 at most, times the matte
  // light that is added up in a slot of its own, the CellPicture::all_slots-th and on.
  struct Painted {
    std::uint32_t first, count;  // of `paint`
    std::uint16_t slot;
  };
  static constexpr std::size_t most_painted_of_pixel = 12,
                               most_painted = most_painted_of_pixel * cell_pixels;
  struct Paint {
    float share, x, y;
    std::uint16_t level;  // of FrameLight::levels
  };
  // A pixel of further samples: those that share the whole radiance of a centre, and how many all
  // are.
  struct Borrowed {
    std::uint16_t pixel, centre, count;
  };
  struct Further {
    std::uint16_t pixel, count;
    Base base;
  };

  // Live pictures before what blocks share, each pixel's own: it shows their radiance, and `passed`
  // of the block's. The last of the four is 0, and the mean.
  struct Foreground {
    std::array<Four, cell_pixels> radiance, passed;
  };

  // Of a cell that was found without live pictures.
  //
  // A ray that surfaces sent on and that pictures may come before: the slot `target` shows what
  // they show, and as much as they let pass of a slot of the ray's own, the slots-th and on.
  struct PictureRay {
    Vec3f origin, direction, throughput;
    Spread spread, steps;  // of its cone, as it begins
    float far_m;           // what it meets is there
    float roughness;       // of the lobe that it is in the middle of
    float stands_for;      // so many as dim as it is, of which the others see no pictures
    std::uint16_t target;
    std::uint16_t lender;  // the centre that has what is behind, or no_lender
    RayKind kind;
    std::uint8_t behind;  // so many others on its path
    bool one_of_many;     // of rays all over a lobe
    static constexpr std::uint16_t no_lender = 0xFFFF;
  };
  static constexpr std::size_t most_picture_rays = 31 * EnvironmentTerms::slots;
  // Slot += weight * light of the table, or intensity of a lamp, as far as pictures let it pass.
  struct PictureLight {
    Vec3f origin, direction, weight;
    float far_m;       // where the light is
    float stands_for;  // as of picture rays
    std::uint32_t slot;
    std::uint16_t light;
    bool lamp;
  };
  // Centres that pictures may cast shadows on: where their shadow rays begin, and how wide a square
  // of the surface each stands for.
  struct Shadowed {
    alignas(64) std::array<float, cell_pixels> px, py, pz, width_m;
    std::uint32_t smooth = 0;  // squares that are one smooth surface, a bit each (cell_squares.h)

    Scene::Bounds box;  // around them

    Vec3f position(std::size_t k) const { return {px[k], py[k], pz[k]}; }
  };

  // Pixels that share a camera ray.
  struct Blocks {
    int size = 1;                               // pixels a side
    int columns = cell_size, rows = cell_size;  // of the cell's pixels that are in the picture

    // The pixel that has the ray of its block: one next to the middle, through which it goes.
    int middle(int i, int end) const { return std::min(i - i % size + (size - 1) / 2, end - 1); }
    // How far the block's middle is from that pixel's.
    float off(int i, int end) const {
      const int first = i - i % size, last = std::min(first + size, end) - 1;
      return 0.5F * static_cast<float>(first + last) - static_cast<float>(middle(i, end));
    }
    bool has_ray(int x, int y) const {
      return x < columns && y < rows && middle(x, columns) == x && middle(y, rows) == y;
    }
  };

  bool empty = true;  // nothing but plate
  Blocks blocks;
  std::vector<Foreground> foreground;  // one, or none; of blocks alone
  std::vector<Base> bases;             // most cells have one or two of them
  std::array<std::uint8_t, cell_pixels> base_of{};
  std::vector<Centres> centres;  // one; or none, where no centre receives light
  CellMask receiving{};
  CellVisibility visibility;
  std::vector<Mirrored> mirrored;  // one, or none
  CellMask mirrored_receiving{};
  CellVisibility mirrored_visibility;
  std::vector<SharedTerm> shared;
  std::vector<LightTerm> lights;
  EnvironmentTerms environment;
  std::vector<ShadowPoint> shadow_points;
  std::vector<ShadowLight> shadow_lights;
  std::vector<Vec3f> shadow_tints;  // shares that are lost
  CellLamps lamps;                  // that centres see
  std::vector<LightTerm> lamp_terms;
  std::vector<LampCatcher> catchers;
  std::vector<CaughtLamp> caught;
  std::vector<PlaceTerm>
      bent;  // of the plate where clear bodies show it lit, in FrameLight::levels
  std::vector<ShadedPlate> bent_shaded;
  std::vector<BentCaustic> bent_caustics;
  std::vector<PlaceTerm> video;  // of live textures, in FrameLight::levels
  std::vector<Painted> painted;
  std::vector<Paint> paint;
  std::vector<Borrowed> borrowed;
  std::vector<Further> further;
  bool past_pictures = false;  // found without live pictures
  // How far each pixel's camera ray comes before it meets what hides pictures.
  std::vector<float> far_m;
  std::vector<PictureRay> picture_rays;
  std::vector<Base> bases_behind;                     // of their own slots
  std::vector<EnvironmentTerms> environments_behind;  // of each 512 of these
  std::vector<PictureLight> picture_lights;
  std::vector<PictureLight> picture_shadows;  // `slot` is of shadow_lights
  // Pixels whose further rays look at pictures by themselves, and how far away the nearest and the
  // farthest thing is between which these may come.
  CellMask looks_apart{};
  float nearest_m = 0, farthest_m = 0;
  std::vector<Shadowed> shadowed, mirrored_shadowed;  // one each, or none
  CellReach reach;                                    // if anything moves
  ShadowAnswers shadow_answers;
  std::uint64_t rays = 0;  // that it took
  // By pixel, or empty if nobody has asked: a cell that is kept without them is found anew, once.
  std::vector<RayCount> counts;

  const Base& base(std::size_t k) const { return bases[base_of[k]]; }
  bool bends_plate() const { return !bent.empty() || !bent_shaded.empty(); }
  // For a cell to be found: with centres, and without bases.
  void clear();
  std::size_t bytes() const;
};

// The light of one frame, as relight() wants it.
struct FrameLight {
  std::span<const DirectionalLight> lights;
  std::span<const Four> irradiances;  // of `lights`
  std::span<const LocalLight> lamps;
  std::span<const capture::Image* const>
      levels;  // of the environment: levels_of(), then the plate's, then those of live textures
  const BorderedLevels& environment;
};

// The share of light that is not lost: 1 - lost/open, exactly 1 where nothing is.
inline Vec3f passing(Vec3f open, Vec3f lost) {
  const auto share = [](float all, float gone) {
    return gone > 0 && all > 0 ? std::max(0.0F, 1 - gone / all) : 1.0F;
  };
  return {share(open.x, lost.x), share(open.y, lost.y), share(open.z, lost.z)};
}

// By how much of the light that is there other light brightens a place. Nothing where next to none
// is: that is no measure.
inline Vec3f brightening(Vec3f open, Vec3f gathered) {
  const auto share = [](float all, float more) {
    return all > 0 && more < 1e4F * all ? more / all : 0.0F;
  };
  return {share(open.x, gathered.x), share(open.y, gathered.y), share(open.z, gathered.z)};
}

// A picture's value at a place in its pixels, bilinear; the outermost go on beyond its edge.
Vec3f plate_at(const capture::Image& level, float x, float y);
// How much rays that see the plate elsewhere than behind their own pixel see of it at a place in
// its pixels: nothing beyond its edge, where they see the environment; and, `mirrored`, less and
// less towards it, so that no seam shows.
float plate_share_at(const capture::Image& plate, double x, double y, bool mirrored);

// What live pictures do in a frame to a cell that was found without them.
struct CellPictures {
  struct Seen {
    Vec3f radiance, passed;
  };
  std::vector<Seen> along;              // of the picture rays
  std::vector<Vec3f> lit_through;       // of the picture lights: what passes
  std::vector<Vec3f> shadowed_through;  // of those of shadow lights
  // What centres lose, and what these mirror.
  bool shades = false, shades_mirrored = false;
  LostLight lost, mirrored_lost;
  bool shades_lamps = false;
  ColourPlanes lamps_lost;  // what centres lose of lamps
  bool has_foreground = false;
  CellTransport::Foreground foreground;

  bool any() const {
    return has_foreground || !along.empty() || !lit_through.empty() || !shadowed_through.empty() ||
           shades || shades_mirrored || shades_lamps;
  }
};

// What relight() works in.
struct RelightWorkspace {
  LightSums light, mirrored, soft;
  ColourPlanes lamps;
  // Irradiance, lamps' too; share that is seen of what is not lamps'.
  ColourPlanes arriving, passing, mirrored_arriving, mirrored_passing;
  std::vector<Vec3f> caught;  // irradiance of lamps at catchers
  // At shadow points: irradiance, where nothing virtual is in the way; share of it that arrives.
  std::vector<Vec3f> open_at_points, passing_at_points;
};

// What a pixel shows: plate * share + added. The first 256 are the pixels; after them, while they
// are lit, their further samples' sums, and what lies behind picture rays; and at last the matte
// light of what is painted.
struct CellPicture {
  static constexpr std::size_t all_slots = slots + CellTransport::most_picture_rays;
  static constexpr std::size_t lit_slots = all_slots + CellTransport::most_painted;
  std::array<Four, lit_slots> added;
  std::array<Four, all_slots> share;  // the last of the four: their mean
  std::array<float, all_slots> seen;
};

// A cell under the light of a frame, with what the frame's live pictures do to it, if it was found
// without them and they do anything. `plate` in scene-linear light decides where lamps on stand-ins
// find their albedo.
void relight(const CellTransport& cell,
             const FrameLight& light,
             std::span<const Four, cell_pixels> plate,
             RelightWorkspace& workspace,
             CellPicture& picture,
             RenderStatistics& statistics,
             const CellPictures* pictures = nullptr);

}  // namespace render
