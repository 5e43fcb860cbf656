// Solid glass and other clear bodies: the shader "glass".
//
// At each surface both rays are followed, mirrored and refracted, with the exact shares of
// Fresnel's equations for unpolarised light; beyond the critical angle all is mirrored. What passes
// a surface takes its tint, as by a coloured foil; inside, light is absorbed by Beer's law. Bodies
// may be nested (a bulb in glass in air), or overlap a little where they touch: of two at the same
// place, the one of higher priority is the one that is there (Schmidt and Budge, "Simple Nested
// Dielectrics in Ray Traced Images", JGT 7(2), 2002).
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "render/environment.h"
#include "render/mesh.h"

namespace render {

struct HitPoint;
class Scene;

// Parameter block of the shader "glass".
struct GlassParameters {
  float index = 1.5F;               // of refraction, 1 to 4, at 587.6 nm
  float absorption[3] = {0, 0, 0};  // per metre, 0 or more
  float abbe = 0;                   // (n_d - 1) / (n_F - n_C); 0 = no dispersion, else 5 or more
  std::int32_t priority = 0;        // of overlapping bodies, the higher is there
  // Share of light that goes straight through one surface to what lies behind, for shadows of
  // lights whose caustics are not followed (caustics.h), before its tint.
  float shadow[3] = {0.92F, 0.92F, 0.92F};
  float tint[3] = {1, 1, 1};  // share, 0 to 1, of what a surface does not mirror that passes it
};

inline constexpr float least_abbe = 5, most_abbe = 1e4F;

// The block in a material of the shader "glass", and back. Throws std::invalid_argument, naming the
// material, if the block is not one, or a number is out of range.
GlassParameters glass_parameters(const Material& material);
Material make_glass_material(std::string name, const GlassParameters& parameters);

// What a ray that meets glass needs of it.
struct Glass {
  std::array<float, 3> index;
  Vec3f absorption;
  std::int32_t priority;
  Vec3f tint;
};
Glass make_glass(const Material& material);

// The bodies that a ray is inside of: instance and material of each, in the order in which they
// were entered. A ray in more bodies than there is room for takes the rest for absent.
struct Media {
  static constexpr std::size_t most = 6;
  struct Body {
    std::uint32_t instance = 0, material = 0;
    friend bool operator==(const Body&, const Body&) = default;
  };
  std::array<Body, most> bodies{};
  std::uint8_t count = 0;
};

// A ray at a surface of glass.
struct Crossing {
  Media after;                          // once it has passed
  std::array<float, 3> ratio{1, 1, 1};  // of the index before to that after, per colour
  bool seen = false;                    // false: both sides are the same body, or as good as that
  Vec3f tint{1, 1, 1};                  // of what passes, seen or not
};

// `back`: the ray meets the body from inside. Of a body that the ray is not known to be in, it is
// taken to have been.
Crossing cross_surface(const Scene& scene, const Media& media, Media::Body body, bool back);

// What is left, per colour, of light after `distance_m` in the media. All of it where the distance
// has no end, as behind an open mesh.
Vec3f passed_through(const Scene& scene, const Media& media, float distance_m);

// Share of unpolarised light that a surface mirrors: `cosine` of the angle to its normal on the
// side that the light comes from, 0..1; `ratio` of the index of that side to the other's. 1 beyond
// the critical angle.
float fresnel(float cosine, float ratio);

// `incoming` (unit) refracted at a surface of unit normal `normal` that faces it. Zero beyond the
// critical angle.
Vec3f refracted(Vec3f incoming, Vec3f normal, float ratio);

// The same two as rays leave a hit, `incoming` being unit: an interpolated normal never sends what
// is mirrored through the triangle, nor what is refracted back from it. refracted_into() is zero
// beyond the critical angle.
Vec3f mirrored_off(const HitPoint& hit, Vec3f incoming);
Vec3f refracted_into(const HitPoint& hit, Vec3f incoming, float ratio);

// One colour of three.
inline Vec3f only_colour(Vec3f v, std::size_t channel) {
  return {channel == 0 ? v.x : 0.0F, channel == 1 ? v.y : 0.0F, channel == 2 ? v.z : 0.0F};
}

// The index at the wavelengths that stand for red, green, blue (611, 549, 464 nm, the primaries'
// dominant ones), by Cauchy's equation through the index and Abbe's number.
std::array<float, 3> indices_of(const GlassParameters& parameters);

}  // namespace render
