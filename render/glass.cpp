// Fresnel, Snell and Cauchy.
#include "render/glass.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "render/scene.h"
#include "render/standard.h"

namespace render {

GlassParameters glass_parameters(const Material& material) {
  const auto refuse = [&](const std::string& reason) {
    throw std::invalid_argument("glass \"" + material.name + "\": " + reason);
  };
  GlassParameters p;
  if (material.parameters.size() != sizeof p) refuse("wrong parameter block");
  std::memcpy(&p, material.parameters.data(), sizeof p);
  if (!(p.index >= 1 && p.index <= 4)) refuse("the index of refraction must be 1 to 4");
  for (const float a : p.absorption) {
    if (!(a >= 0 && a <= 1e6F)) refuse("absorption must be 0 to 1e6 per metre");
  }
  for (const float s : p.shadow) {
    if (!(s >= 0 && s <= 1)) refuse("shadow must be 0 to 1");
  }
  for (const float t : p.tint) {
    if (!(t >= 0 && t <= 1)) refuse("tint must be 0 to 1");
  }
  if (!(p.abbe == 0 || (p.abbe >= least_abbe && p.abbe <= most_abbe)))
    refuse("abbe must be 0, or 5 to 10000");
  return p;
}

Material make_glass_material(std::string name, const GlassParameters& parameters) {
  Material material{std::move(name), "glass", {}};
  material.parameters.resize(sizeof parameters);
  std::memcpy(material.parameters.data(), &parameters, sizeof parameters);
  return material;
}

Glass make_glass(const Material& material) {
  const GlassParameters p = glass_parameters(material);
  return {indices_of(p),
          {p.absorption[0], p.absorption[1], p.absorption[2]},
          p.priority,
          {p.tint[0], p.tint[1], p.tint[2]}};
}

namespace {

// The body that is there, of all that a ray is in: of the highest priority, the last entered. Null:
// none.
const Glass* present(const Scene& scene, const Media& media) {
  const Glass* there = nullptr;
  for (std::size_t i = 0; i < media.count; ++i) {
    const Glass* glass = scene.glass_of(media.bodies[i].material);
    if (glass != nullptr && (there == nullptr || glass->priority >= there->priority)) there = glass;
  }
  return there;
}

}  // namespace

Crossing cross_surface(const Scene& scene, const Media& media, Media::Body body, bool back) {
  Crossing crossing{media, {1, 1, 1}, false};
  Media& after = crossing.after;
  Media before = media;
  const auto end = after.bodies.begin() + after.count;
  const auto known = std::find(after.bodies.begin(), end, body);
  if (!back) {
    if (after.count < Media::most) after.bodies[after.count++] = body;
  } else if (known != end) {
    std::copy(known + 1, end, known);
    --after.count;
  } else if (before.count < Media::most) {
    before.bodies[before.count++] = body;
  }
  const Glass* from = present(scene, before);
  const Glass* to = present(scene, after);
  if (from == to) return crossing;
  if (const Glass* own = scene.glass_of(body.material)) crossing.tint = own->tint;
  for (std::size_t c = 0; c < 3; ++c) {
    crossing.ratio[c] = (from ? from->index[c] : 1.0F) / (to ? to->index[c] : 1.0F);
    crossing.seen = crossing.seen || std::abs(crossing.ratio[c] - 1) > 1e-6F;
  }
  return crossing;
}

Vec3f passed_through(const Scene& scene, const Media& media, float distance_m) {
  const Glass* there = present(scene, media);
  if (there == nullptr || !(distance_m < 1e6F)) return {1, 1, 1};
  const Vec3f& a = there->absorption;
  if (a == Vec3f{}) return {1, 1, 1};
  return {std::exp(-a.x * distance_m), std::exp(-a.y * distance_m), std::exp(-a.z * distance_m)};
}

float fresnel(float cosine, float ratio) {
  const float c = std::clamp(cosine, 0.0F, 1.0F);
  const float sine2 = ratio * ratio * (1 - c * c);
  if (sine2 >= 1) return 1;
  const float t = std::sqrt(1 - sine2);
  const float across = (ratio * c - t) / (ratio * c + t);
  const float along = (c - ratio * t) / (c + ratio * t);
  return 0.5F * (across * across + along * along);
}

Vec3f refracted(Vec3f incoming, Vec3f normal, float ratio) {
  const float cosine = -dot(incoming, normal);
  const float sine2 = ratio * ratio * (1 - cosine * cosine);
  if (sine2 >= 1) return {};
  return normalize(incoming * ratio + normal * (ratio * cosine - std::sqrt(1 - sine2)));
}

Vec3f mirrored_off(const HitPoint& hit, Vec3f incoming) {
  const Vec3f direction = normalize(mirrored(-incoming, hit.normal));
  const float into = dot(direction, hit.geometric_normal);
  return into < 0 ? direction - hit.geometric_normal * (2 * into) : direction;
}

Vec3f refracted_into(const HitPoint& hit, Vec3f incoming, float ratio) {
  const Vec3f direction = refracted(incoming, hit.normal, ratio);
  const float back = dot(direction, hit.geometric_normal);
  if (direction == Vec3f{} || !(back > -1e-4F)) return direction;
  return normalize(direction - hit.geometric_normal * (back + 1e-3F));  // it grazes the other side
}

std::array<float, 3> indices_of(const GlassParameters& parameters) {
  if (parameters.abbe == 0) return {parameters.index, parameters.index, parameters.index};
  // n = a + b / wavelength^2, in micrometres; d, F and C are 587.6, 486.1 and 656.3 nm.
  constexpr float f = 1 / (0.4861F * 0.4861F), c = 1 / (0.6563F * 0.6563F);
  constexpr float d = 1 / (0.5876F * 0.5876F);
  const float b = (parameters.index - 1) / (parameters.abbe * (f - c));
  const float a = parameters.index - b * d;
  const auto at = [&](float micrometres) {
    return std::max(1.0F, a + b / (micrometres * micrometres));
  };
  return {at(0.611F), at(0.549F), at(0.464F)};
}

}  // namespace render
