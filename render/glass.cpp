// Fresnel, Snell and Cauchy.
#include "render/glass.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

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
  if (!(p.abbe == 0 || (p.abbe >= 5 && p.abbe <= 1e4F))) refuse("abbe must be 0, or 5 to 10000");
  return p;
}

Material make_glass_material(std::string name, const GlassParameters& parameters) {
  Material material{std::move(name), "glass", {}};
  material.parameters.resize(sizeof parameters);
  std::memcpy(material.parameters.data(), &parameters, sizeof parameters);
  return material;
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
