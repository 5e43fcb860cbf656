// The standard surface: glTF 2.0 metallic-roughness with clear coat, thin transmission, emission.
#include "render/standard.h"

#include <cstddef>
#include <cstring>
#include <numbers>
#include <stdexcept>
#include <tuple>
#include <type_traits>
#include <utility>

#include "render/scene.h"
#include "render/texture.h"

namespace render {
namespace {

static_assert(std::is_trivially_copyable_v<StandardParameters>);
static_assert(sizeof(StandardParameters) == 336, "blocks travel: no padding, no surprise");

const Texture* texture_at(const SceneDescription& scene, std::int32_t index) {
  return index < 0 ? nullptr : scene.textures[static_cast<std::size_t>(index)].get();
}

// A hit, and how much of its surface is seen: in metres, and in the mesh's coordinates.
struct SeenPart {
  const HitPoint& hit;
  Spread footprint;
  UvFootprint area;
  SeenPart(const HitPoint& at, const Spread& seen)
      : hit(at), footprint(seen), area{uv_of_step(at, seen.a), uv_of_step(at, seen.b)} {}
  SeenPart point() const { return {hit, {}}; }
};

std::array<float, 4> sample_at(const Texture& texture,
                               const UvTransform& uv,
                               const SeenPart& seen,
                               TextureFilter filter) {
  const HitPoint& hit = seen.hit;
  if (uv == UvTransform{}) return sample(texture, hit.u, hit.v, seen.area, filter);
  std::array<float, 2> place{hit.u, hit.v};
  UvFootprint area = seen.area;
  if (uv.second != 0 && hit.has_second_uvs) {
    const auto step = [&hit](Vec3f s) {
      return std::array{dot(hit.second_u_slope, s), dot(hit.second_v_slope, s)};
    };
    place = hit.second_uv;
    area = {step(seen.footprint.a), step(seen.footprint.b)};
  }
  const auto [u, v] = uv.of_place(place);
  return sample(texture, u, v, {uv.of_step(area.a), uv.of_step(area.b)}, filter);
}

// Of what sample() gives of a texture that is nothing but alpha.
std::size_t alpha_channel(const Texture& texture) { return texture.channels % 2 == 0 ? 3 : 0; }

float unit(float value) { return std::clamp(value, 0.0F, 1.0F); }

// Unit vectors x and y that make a right-handed frame with unit z.
// Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017.
std::pair<Vec3f, Vec3f> frame_about(Vec3f z) {
  const float sign = std::copysign(1.0F, z.z);
  const float a = -1 / (sign + z.z);
  const float b = z.x * z.y * a;
  return {{1 + sign * z.x * z.x * a, sign * b, -sign * z.x}, {b, sign + z.y * z.y * a, -z.y}};
}

// The view above the surface: from below the shading normal it counts as grazing.
constexpr float grazing_cosine = 1e-3F;
Vec3f above(Vec3f view, Vec3f normal) {
  const float cosine = dot(view, normal);
  return cosine >= grazing_cosine ? view : normalize(view + normal * (grazing_cosine - cosine));
}

// What a filtered normal map shows of a surface: the mean of its normals, and how they spread
// about it, as what GGX's alpha squared grows by and as what a matte ground shows less of light.
struct MappedNormal {
  Vec3f normal;
  float rougher = 0;
  float facing = 1;
};

// The spread of normals whose mean is of length `l`: twice the variance of their slopes, by the
// concentration of a von Mises-Fisher distribution.
//
// Toksvig, "Mipmapping Normal Maps", JGT 10(3), 2005; the concentration after Banerjee et al.,
// "Clustering on the Unit Hypersphere using von Mises-Fisher Distributions", JMLR 2005.
float spread_of_normals(float l) {
  const float squared = l * l;
  return squared < 1 ? 2 * (1 - squared) / (l * (3 - squared)) : 0;
}

// And back, to 1 % down to lengths of .4.
float length_of_mean(float spread) { return 1 / (1 + spread * (0.5F + 0.39F * spread)); }

// What normals whose mean is of length `l` get of diffuse light, beside what their mean would: l
// times as much of a light that all of them see, (1 + l) / 2 of half a sky straight above. Halfway.
float facing_of_normals(float l) { return (1 + 3 * l) / 4; }

MappedNormal mapped_normal(const StandardParameters& parameters,
                           const SceneDescription& scene,
                           const SeenPart& seen,
                           TextureFilter filter) {
  const HitPoint& hit = seen.hit;
  const Texture* map = texture_at(scene, parameters.normal_texture);
  if (map == nullptr || dot(hit.tangent, hit.tangent) == 0) return {hit.normal};
  const auto in_tangents = [&](const SeenPart& over) {
    const auto texel = sample_at(*map, parameters.normal_uv, over, filter);
    return Vec3f{2 * texel[0] - 1, 2 * texel[1] - 1, 2 * texel[2] - 1};
  };
  const Vec3f mean = in_tangents(seen);
  const Vec3f tangent = normalize(hit.tangent - hit.normal * dot(hit.normal, hit.tangent));
  const Vec3f bitangent = cross(hit.normal, tangent) * hit.handedness;
  const float scale = parameters.normal_scale;
  const Vec3f normal = (tangent * mean.x + bitangent * mean.y) * scale + hit.normal * mean.z;
  const float l = length(normal);
  if (!(l > 1e-6F) || !(dot(normal, hit.normal) > 0)) return {hit.normal};
  MappedNormal mapped{normal / l};
  if (seen.footprint.a == Vec3f{} && seen.footprint.b == Vec3f{}) return mapped;
  // Beside the map's own texels, whose eight bits are no unit vectors either.
  const float of_map = length(mean) / length(in_tangents(seen.point()));
  mapped.rougher = scale * scale * spread_of_normals(of_map);
  if (mapped.rougher > 0) mapped.facing = facing_of_normals(length_of_mean(mapped.rougher));
  return mapped;
}

}  // namespace

StandardParameters standard_parameters(const Material& material,
                                       std::size_t texture_count,
                                       std::size_t video_count) {
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument("material '" + material.name + "': " + why);
  };
  if (material.shader != "standard")
    refuse("its shader is '" + material.shader + "', not standard");
  StandardParameters parameters;
  if (material.parameters.size() != sizeof parameters)
    refuse("its block has " + std::to_string(material.parameters.size()) + " bytes, not " +
           std::to_string(sizeof parameters));
  std::memcpy(&parameters, material.parameters.data(), sizeof parameters);
  for (const float value :
       {parameters.base_color[0], parameters.base_color[1], parameters.base_color[2],
        parameters.metallic, parameters.roughness, parameters.clearcoat,
        parameters.clearcoat_roughness, parameters.transmission, parameters.emission[0],
        parameters.emission[1], parameters.emission[2], parameters.emission_gain,
        parameters.normal_scale, parameters.alpha_cutoff, parameters.base_color_alpha,
        parameters.specular, parameters.opacity})
    if (!std::isfinite(value)) refuse("a number of its block is not finite");
  for (const std::int32_t index :
       {parameters.base_color_texture, parameters.metallic_roughness_texture,
        parameters.normal_texture, parameters.clearcoat_texture, parameters.transmission_texture,
        parameters.emission_texture, parameters.clearcoat_roughness_texture,
        parameters.alpha_texture})
    if (index < -1 || (index >= 0 && static_cast<std::size_t>(index) >= texture_count))
      refuse("it names texture " + std::to_string(index) + " of " + std::to_string(texture_count));
  for (const UvTransform& uv :
       {parameters.base_color_uv, parameters.metallic_roughness_uv, parameters.normal_uv,
        parameters.clearcoat_uv, parameters.transmission_uv, parameters.emission_uv,
        parameters.clearcoat_roughness_uv, parameters.alpha_uv}) {
    const auto finite = [](float x) { return std::isfinite(x); };
    if (!std::ranges::all_of(uv.u, finite) || !std::ranges::all_of(uv.v, finite))
      refuse("a place of its textures is not finite");
  }
  for (const std::int32_t video : {parameters.emission_video, parameters.base_color_video})
    if (video < -1 || (video >= 0 && static_cast<std::size_t>(video) >= video_count))
      refuse("it names video " + std::to_string(video) + " of " + std::to_string(video_count));
  return parameters;
}

Material make_standard_material(std::string name, const StandardParameters& parameters) {
  Material material{std::move(name), "standard", {}};
  material.parameters.resize(sizeof parameters);
  std::memcpy(material.parameters.data(), &parameters, sizeof parameters);
  return material;
}

StandardSurface standard_surface(const StandardParameters& parameters,
                                 const SceneDescription& scene,
                                 const HitPoint& hit,
                                 const Spread& footprint,
                                 TextureFilter filter) {
  const SeenPart seen(hit, footprint);
  const auto look_up = [&](std::int32_t index, const UvTransform& uv) -> std::array<float, 4> {
    const Texture* texture = texture_at(scene, index);
    return texture == nullptr ? std::array<float, 4>{1, 1, 1, 1}
                              : sample_at(*texture, uv, seen, filter);
  };
  const auto alpha_of = [&](std::int32_t index) {
    return look_up(index, parameters.alpha_uv)[alpha_channel(*texture_at(scene, index))];
  };
  StandardSurface surface;
  const auto base = look_up(parameters.base_color_texture, parameters.base_color_uv);
  surface.base = {unit(parameters.base_color[0] * base[0] * hit.colour.x),
                  unit(parameters.base_color[1] * base[1] * hit.colour.y),
                  unit(parameters.base_color[2] * base[2] * hit.colour.z)};
  surface.alpha = parameters.base_color_alpha *
                  (parameters.alpha_texture < 0 ? base[3] : alpha_of(parameters.alpha_texture));
  const auto metallic_roughness =
      look_up(parameters.metallic_roughness_texture, parameters.metallic_roughness_uv);
  surface.metallic = unit(parameters.metallic * metallic_roughness[2]);
  surface.roughness = unit(parameters.roughness * metallic_roughness[1]);
  surface.clearcoat = unit(parameters.clearcoat);
  if (surface.clearcoat > 0)
    surface.clearcoat *= look_up(parameters.clearcoat_texture, parameters.clearcoat_uv)[0];
  surface.clearcoat_roughness = unit(parameters.clearcoat_roughness);
  if (surface.clearcoat > 0) {
    surface.clearcoat_roughness *=
        look_up(parameters.clearcoat_roughness_texture, parameters.clearcoat_roughness_uv)[1];
  }
  surface.specular = unit(parameters.specular);
  surface.opacity = unit(parameters.opacity);
  surface.transmission = unit(parameters.transmission);
  if (surface.transmission > 0)
    surface.transmission *= look_up(parameters.transmission_texture, parameters.transmission_uv)[0];
  surface.emission = Vec3f{parameters.emission[0], parameters.emission[1], parameters.emission[2]} *
                     parameters.emission_gain;
  if (surface.emission != Vec3f{}) {
    const auto emission = look_up(parameters.emission_texture, parameters.emission_uv);
    surface.emission = {surface.emission.x * emission[0], surface.emission.y * emission[1],
                        surface.emission.z * emission[2]};
  }
  if (parameters.alpha_blend != 0) {
    surface.coverage = unit(surface.alpha);
    surface.emission = surface.emission * surface.coverage;
  }
  const MappedNormal mapped = mapped_normal(parameters, scene, seen, filter);
  surface.normal = mapped.normal;
  surface.facing = mapped.facing;
  if (mapped.rougher > 0) {
    const float alpha = surface.roughness * surface.roughness;
    surface.roughness = std::sqrt(std::min(std::sqrt(alpha * alpha + mapped.rougher), 1.0F));
  }
  surface.coat_normal = hit.normal;
  return surface;
}

float standard_alpha(const StandardParameters& parameters,
                     const SceneDescription& scene,
                     const HitPoint& hit) {
  const Texture* own = texture_at(scene, parameters.alpha_texture);
  const Texture* texture = own ? own : texture_at(scene, parameters.base_color_texture);
  if (texture == nullptr) return parameters.base_color_alpha;
  const std::size_t channel = own ? alpha_channel(*own) : 3;
  const UvTransform& uv = own ? parameters.alpha_uv : parameters.base_color_uv;
  return parameters.base_color_alpha *
         sample_at(*texture, uv, SeenPart(hit, {}), TextureFilter::dense)[channel];
}

Vec3f sample_lobe(Vec3f normal, Vec3f view, float roughness, std::array<float, 2> random) {
  const float alpha = roughness * roughness;
  const auto [x, y] = frame_about(normal);
  view = above(view, normal);
  const Vec3f v{dot(x, view), dot(y, view), dot(normal, view)};
  // Heitz 2018: stretch, sample the visible half disc, unstretch.
  const Vec3f stretched = normalize(Vec3f{alpha * v.x, alpha * v.y, v.z});
  const auto [t1, t2] = frame_about(stretched);
  const float radius = std::sqrt(random[0]);
  const float phi = 2 * std::numbers::pi_v<float> * random[1];
  const float p1 = radius * std::cos(phi);
  // The half disc is squeezed towards the side that the view sees.
  const Vec3f up = normalize(Vec3f{0, 0, 1} - stretched * stretched.z);
  const bool upright = stretched.z < 0.99999F;
  const Vec3f a = upright ? cross(up, stretched) : t1;
  const Vec3f b = upright ? up : t2;
  const float s = 0.5F * (1 + stretched.z);
  const float p2 = (1 - s) * std::sqrt(std::max(0.0F, 1 - p1 * p1)) + s * radius * std::sin(phi);
  const float p3 = std::sqrt(std::max(0.0F, 1 - p1 * p1 - p2 * p2));
  const Vec3f h_stretched = a * p1 + b * p2 + stretched * p3;
  const Vec3f h = normalize(
      Vec3f{alpha * h_stretched.x, alpha * h_stretched.y, std::max(1e-7F, h_stretched.z)});
  const Vec3f l = mirrored(v, h);
  return normalize(x * l.x + y * l.y + normal * std::abs(l.z));
}

float lobe_density(Vec3f normal, Vec3f view, float roughness, Vec3f direction) {
  return SeenLobe(normal, normal, view).density(roughness * roughness, direction);
}

SeenLobe::SeenLobe(Vec3f normal, Vec3f geometric_normal, Vec3f view)
    : normal_(normal), geometric_normal_(geometric_normal), middle_(mirrored(view, normal)) {
  std::tie(x_, y_) = frame_about(normal);
  view = above(view, normal);
  view_ = {dot(x_, view), dot(y_, view), dot(normal, view)};
  slope_squared_ = (view_.x * view_.x + view_.y * view_.y) / (view_.z * view_.z);
}

namespace {

// Of a lobe that `view`, in the lobe's frame, sees: its density towards a direction in that frame,
// or eight; a2 is alpha squared.
template <class F>
F density_in_frame(Vec3f view, float slope_squared, F a2, F x, F y, F z) {
  // Of the visible normals' reflections, before directions below are folded up. 1 - h_z^2 (1 - a2)
  // without cancellation near the peak; the factors that all directions share come last.
  const F across_x = view.x + x, across_y = view.y + y;
  const auto unfolded = [&](F up) -> F {
    const F squared = across_x * across_x + across_y * across_y + up * up;
    const F width = across_x * across_x + across_y * across_y + a2 * up * up;
    const F relative = squared / width;
    return up > 0 ? relative * relative : F{};
  };
  const F densities = unfolded(view.z + z) + unfolded(view.z - z);
  const F masking = 2 / (1 + root(1 + a2 * slope_squared));
  return z > 0 ? densities * masking * a2 / (4 * std::numbers::pi_v<float> * view.z) : F{};
}

// Alpha squared of a lobe that is blurred as by a disc: half of a lobe lies within 2 alpha of the
// mirrored direction, as half of a disc of radius r does within .7 r.
template <class F>
F blurred_alpha_squared(float roughness, F blur_rad) {
  constexpr float alpha_of_radius = 0.35F;
  const float own = roughness * roughness;
  const F blur = alpha_of_radius * blur_rad, squared = own * own + blur * blur;
  return squared < 1 ? squared : F{} + 1;
}

}  // namespace

float SeenLobe::density(float alpha, Vec3f direction) const {
  return density_in_frame(view_, slope_squared_, alpha * alpha, dot(x_, direction),
                          dot(y_, direction), dot(normal_, direction));
}

float SeenLobe::blurred(float roughness, float blur_rad, Vec3f direction) const {
  const float alpha = std::sqrt(blurred_alpha_squared(roughness, blur_rad));
  const Vec3f below = direction - geometric_normal_ * (2 * dot(direction, geometric_normal_));
  return density(alpha, direction) + density(alpha, below);
}

Eight SeenLobe::blurred(float roughness,
                        Eight blur_rad,
                        const calibrate::Vec3T<Eight>& direction) const {
  const auto along = [](Vec3f axis, const calibrate::Vec3T<Eight>& d) {
    return axis.x * d.x + axis.y * d.y + axis.z * d.z;
  };
  const Eight a2 = blurred_alpha_squared(roughness, blur_rad);
  const auto density_of = [&](const calibrate::Vec3T<Eight>& d) {
    return density_in_frame(view_, slope_squared_, a2, along(x_, d), along(y_, d),
                            along(normal_, d));
  };
  const Vec3f n = geometric_normal_;
  const Eight twice = 2 * along(n, direction);
  return density_of(direction) + density_of({direction.x - twice * n.x, direction.y - twice * n.y,
                                             direction.z - twice * n.z});
}

}  // namespace render
