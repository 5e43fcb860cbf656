// The standard surface: its energy and its lobes.
#include "render/standard.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include "render/scene.h"
#include "render/texture.h"

namespace render::standard_test {
namespace {

using calibrate::Vec3f;
using render::HitPoint;
using render::SceneDescription;
using render::StandardParameters;
using render::StandardSurface;

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  float operator()() { return std::uniform_real_distribution<float>(0, 1)(engine_); }
  Vec3f direction() {
    const float z = 2 * (*this)() - 1;
    const float phi = 2 * std::numbers::pi_v<float> * (*this)();
    const float r = std::sqrt(1 - z * z);
    return {r * std::cos(phi), r * std::sin(phi), z};
  }

 private:
  std::mt19937 engine_;
};

StandardSurface white_surface(Vec3f normal) {
  StandardSurface surface{};
  surface.base = {1, 1, 1};
  surface.normal = surface.coat_normal = normal;
  surface.alpha = 1;
  return surface;
}

TEST(StandardWeights, PassOnAllLightOfAWhiteSurface) {
  Random random(1);
  for (int trial = 0; trial < 1000; ++trial) {
    const Vec3f normal = random.direction();
    StandardSurface surface = white_surface(normal);
    surface.metallic = random();
    surface.clearcoat = random();
    surface.transmission = random();
    surface.specular = random();
    surface.opacity = random();
    surface.coverage = random();
    Vec3f view = random.direction();
    if (dot(view, normal) < 0) view = -view;
    const auto w = render::standard_weights(surface, view);
    EXPECT_NEAR(w.coat + w.specular.x + w.diffuse.x + w.transmission.x, 1, 1e-5);
  }
}

TEST(StandardWeights, MirrorTheShareThatSpecularStatesUnlessOfMetal) {
  Random random(9);
  for (int trial = 0; trial < 100; ++trial) {
    const Vec3f normal = random.direction();
    const Vec3f view = random.direction();
    StandardSurface surface = white_surface(normal);
    const float whole = render::standard_weights(surface, view).specular.x;
    surface.specular = 0.25F;
    EXPECT_NEAR(render::standard_weights(surface, view).specular.x, 0.25F * whole, 1e-6);
    surface.metallic = 1;
    EXPECT_NEAR(render::standard_weights(surface, view).specular.x, 1, 1e-6);
  }
}

TEST(StandardWeights, PassLightUntintedByOpacity) {
  StandardSurface surface = white_surface({0, 0, 1});
  surface.base = {0, 0, 0};
  surface.opacity = 0.25F;
  const auto dark_glass = render::standard_weights(surface, {0, 0, 1});
  EXPECT_NEAR(dark_glass.transmission.x, 0.96 * 0.75, 1e-5);
  EXPECT_EQ(dark_glass.diffuse.x, 0);
  EXPECT_NEAR(dark_glass.specular.x, 0.04, 1e-6) << "it mirrors as before";
  surface.base = {1, 0.5F, 0};
  const auto tinted = render::standard_weights(surface, {0, 0, 1});
  EXPECT_EQ(tinted.transmission, dark_glass.transmission);
  EXPECT_NEAR(tinted.diffuse.y, 0.96 * 0.25 * 0.5, 1e-5);
}

TEST(StandardWeights, CoverWhatIsBehindByTheirCoverage) {
  StandardSurface surface = white_surface({0, 0, 1});
  surface.base = {1, 0.5F, 0};
  surface.clearcoat = 1;
  const auto whole = render::standard_weights(surface, {0, 0, 1});
  surface.coverage = 0.25F;
  const auto quarter = render::standard_weights(surface, {0, 0, 1});
  EXPECT_NEAR(quarter.coat, 0.25 * whole.coat, 1e-6);
  EXPECT_NEAR(quarter.specular.y, 0.25 * whole.specular.y, 1e-6);
  EXPECT_NEAR(quarter.diffuse.y, 0.25 * whole.diffuse.y, 1e-6);
  EXPECT_NEAR(quarter.transmission.y, 0.75, 1e-6) << "the rest is seen as if it was not there";
}

TEST(StandardSurface, IsCoveredByTheAlphaOfItsPictureWhereThatBlends) {
  StandardParameters p;
  p.base_color_texture = 0;
  p.base_color_alpha = 0.5F;
  std::fill_n(p.emission, 3, 4.0F);
  SceneDescription scene;
  scene.textures = {std::make_shared<const render::Texture>(
      render::Texture{1, 1, 4, true, {255, 255, 255, 102}})};
  HitPoint hit;
  hit.normal = hit.geometric_normal = {0, 0, 1};
  EXPECT_EQ(render::standard_surface(p, scene, hit).coverage, 1);
  p.alpha_blend = 1;
  const StandardSurface surface = render::standard_surface(p, scene, hit);
  EXPECT_NEAR(surface.coverage, 0.5 * 0.4, 1e-5);
  EXPECT_NEAR(surface.emission.x, 4 * 0.2, 1e-5);
}

TEST(StandardWeights, NeverPassOnMoreThanArrives) {
  Random random(2);
  for (int trial = 0; trial < 1000; ++trial) {
    const Vec3f normal = random.direction();
    StandardSurface surface = white_surface(normal);
    surface.base = {random(), random(), random()};
    surface.metallic = random();
    surface.clearcoat = random();
    surface.transmission = random();
    surface.opacity = random();
    surface.coverage = random();
    const auto w = render::standard_weights(surface, random.direction());
    const Vec3f sum = w.specular + w.diffuse + w.transmission;
    for (const float channel : {sum.x, sum.y, sum.z}) {
      EXPECT_LE(channel + w.coat, 1 + 1e-5);
      EXPECT_GE(channel, 0);
    }
  }
}

// The integral of a density over the upper hemisphere.
template <class Density>
double over_hemisphere(Density density) {
  constexpr int steps = 400;
  double sum = 0;
  for (int j = 0; j < steps; ++j) {
    for (int i = 0; i < 4 * steps; ++i) {
      const double z = (j + 0.5) / steps;
      const double phi = 2 * std::numbers::pi * (i + 0.5) / (4 * steps);
      const double r = std::sqrt(1 - z * z);
      sum += density(Vec3f{static_cast<float>(r * std::cos(phi)),
                           static_cast<float>(r * std::sin(phi)), static_cast<float>(z)});
    }
  }
  return sum * 2 * std::numbers::pi / (4.0 * steps * steps);
}

TEST(SampleLobe, KeepsAllItsEnergyAboveTheSurface) {
  Random random(3);
  for (const float roughness : {render::mirror_roughness, 0.1F, 0.3F, 0.6F, 1.0F}) {
    for (const float cosine : {1.0F, 0.7F, 0.2F, 0.03F}) {
      const Vec3f normal{0, 0, 1};
      const Vec3f view{std::sqrt(1 - cosine * cosine), 0, cosine};
      // Importance-sampled: the mean of density / density is 1 where every direction is above; what
      // is tested is that the density that is returned is the one that is sampled.
      double inside = 0;
      const int count = 20000;
      for (int i = 0; i < count; ++i) {
        const Vec3f l = render::sample_lobe(normal, view, roughness, {random(), random()});
        ASSERT_NEAR(length(l), 1, 1e-4);
        ASSERT_GE(l.z, 0);
        const float density = render::lobe_density(normal, view, roughness, l);
        ASSERT_TRUE(std::isfinite(density));
        inside += l.x < 0 ? 1 : 0;
      }
      // The same share by integrating the density over the hemisphere.
      if (roughness < 0.3F) continue;
      const auto density = [&](Vec3f l) {
        return render::lobe_density(normal, view, roughness, l);
      };
      const double integral = over_hemisphere(density);
      const double share = over_hemisphere([&](Vec3f l) { return l.x < 0 ? density(l) : 0.0F; });
      EXPECT_NEAR(integral, 1, 5e-3) << "roughness " << roughness << ", cosine " << cosine;
      EXPECT_NEAR(inside / count, share, 0.015)
          << "roughness " << roughness << ", cosine " << cosine;
    }
  }
}

TEST(LobeDensity, IsZeroBelowTheSurfaceAndFiniteFromBelowTheShadingNormal) {
  const Vec3f normal{0, 0, 1};
  EXPECT_EQ(render::lobe_density(normal, {0, 0.6F, 0.8F}, 0.5F, {0, 0.6F, -0.8F}), 0);
  const Vec3f below{0.8F, 0, -0.6F};
  const Vec3f l = render::sample_lobe(normal, below, 0.3F, {0.3F, 0.6F});
  EXPECT_GE(l.z, 0);
  EXPECT_TRUE(std::isfinite(render::lobe_density(normal, below, 0.3F, l)));
}

// Interpolated normals lean away from the triangle's own: what would go below it is mirrored up.
TEST(SeenLobe, KeepsAllItsEnergyAboveTheTriangle) {
  const Vec3f triangle{0, 0, 1};
  for (const float lean_rad : {0.0F, 0.4F, 0.9F}) {
    const Vec3f normal{std::sin(lean_rad), 0, std::cos(lean_rad)};
    for (const float blur_rad : {0.0F, 0.5F}) {
      const Vec3f view = normalize(Vec3f{-0.5F, 0.6F, 0.8F});
      const render::SeenLobe lobe(normal, triangle, view);
      const double integral =
          over_hemisphere([&](Vec3f l) { return lobe.blurred(0.6F, blur_rad, l); });
      EXPECT_NEAR(integral, 1, 0.01) << "lean " << lean_rad << ", blur " << blur_rad;
    }
  }
}

TEST(SeenLobe, IsTheSameForEightDirectionsAtOnce) {
  const render::SeenLobe lobe(normalize(Vec3f{0.3F, 0, 1}), {0, 0, 1},
                              normalize(Vec3f{-0.5F, 0.6F, 0.4F}));
  calibrate::Vec3T<render::Eight> directions;
  render::Eight blur_rad{};
  for (int i = 0; i < 8; ++i) {
    const auto turn = static_cast<float>(i);
    const Vec3f to = normalize(Vec3f{std::cos(turn), std::sin(turn), 0.4F * turn - 1});
    directions.x[i] = to.x, directions.y[i] = to.y, directions.z[i] = to.z;
    blur_rad[i] = 0.1F * turn;
  }
  directions.x[7] = directions.y[7] = directions.z[7] = 0;  // as where rows are filled up
  const render::Eight densities = lobe.blurred(0.5F, blur_rad, directions);
  for (int i = 0; i < 8; ++i) {
    const Vec3f to{directions.x[i], directions.y[i], directions.z[i]};
    const float alone = lobe.blurred(0.5F, blur_rad[i], to);
    EXPECT_NEAR(densities[i], alone, 1e-4F * alone) << i;
  }
  EXPECT_EQ(densities[7], 0);
}

TEST(StandardParameters, ComeBackFromTheirMaterial) {
  render::StandardParameters p;
  p.roughness = 0.125F;
  p.normal_texture = 2;
  const auto material = render::make_standard_material("paint", p);
  const auto back = render::standard_parameters(material, 3);
  EXPECT_EQ(std::memcmp(&p, &back, sizeof p), 0);
  EXPECT_THROW(render::standard_parameters(material, 2), std::invalid_argument);
}

TEST(StandardParameters, RefuseAVideoThatIsNotThere) {
  render::StandardParameters p;
  p.emission_video = 1;
  const auto material = render::make_standard_material("screen", p);
  EXPECT_EQ(render::standard_parameters(material, 0, 2).emission_video, 1);
  EXPECT_THROW(render::standard_parameters(material, 0, 1), std::invalid_argument);
  EXPECT_THROW(render::standard_parameters(material, 0), std::invalid_argument);
  p.emission_video = -2;
  EXPECT_THROW(render::standard_parameters(render::make_standard_material("screen", p), 0, 2),
               std::invalid_argument);
}

TEST(StandardParameters, RefuseTransformsThatAreNotFinite) {
  render::StandardParameters p;
  p.alpha_uv.v[2] = std::nanf("");
  EXPECT_THROW(render::standard_parameters(render::make_standard_material("leaf", p), 0),
               std::invalid_argument);
}

TEST(StandardParameters, RefuseAnotherShaderAWrongSizeAndNaN) {
  render::StandardParameters p;
  auto material = render::make_standard_material("paint", p);
  material.parameters.pop_back();
  EXPECT_THROW(render::standard_parameters(material, 0), std::invalid_argument);
  material = render::make_standard_material("paint", p);
  material.shader = "stand_in";
  EXPECT_THROW(render::standard_parameters(material, 0), std::invalid_argument);
  p.metallic = NAN;
  EXPECT_THROW(render::standard_parameters(render::make_standard_material("paint", p), 0),
               std::invalid_argument);
}

// A texture of one colour, but for its left half.
SceneDescription scene_with_texture(std::array<std::uint8_t, 3> left,
                                    std::array<std::uint8_t, 3> right) {
  std::vector<std::uint8_t> texels;
  for (int i = 0; i < 64; ++i) {
    const auto& texel = i % 8 < 4 ? left : right;
    texels.insert(texels.end(), texel.begin(), texel.end());
  }
  SceneDescription scene;
  scene.textures = {
      std::make_shared<render::Texture>(render::make_texture(8, 8, 3, false, texels))};
  return scene;
}

HitPoint hit_at(float u) {
  HitPoint hit;
  hit.normal = hit.geometric_normal = {0, 0, 1};
  hit.tangent = {1, 0, 0};
  hit.u = u;
  hit.v = 0.5F;
  hit.uv_per_metre = 1;
  hit.u_slope = {1, 0, 0};
  hit.v_slope = {0, 1, 0};
  return hit;
}

TEST(StandardSurface, TakesTheCoatsRoughnessTimesTheGreenOfItsMap) {
  const SceneDescription scene = scene_with_texture({9, 51, 200}, {9, 255, 200});
  StandardParameters parameters;
  parameters.clearcoat = 1;
  parameters.clearcoat_roughness = 0.5F;
  parameters.clearcoat_roughness_texture = 0;
  EXPECT_NEAR(standard_surface(parameters, scene, hit_at(0.25F)).clearcoat_roughness, 0.1, 1e-4);
  EXPECT_NEAR(standard_surface(parameters, scene, hit_at(0.75F)).clearcoat_roughness, 0.5, 1e-4);
  parameters.clearcoat_roughness_texture = 1;
  EXPECT_THROW(standard_parameters(render::make_standard_material("paint", parameters), 1),
               std::invalid_argument);
}

TEST(StandardSurface, LooksEachTextureUpByItsOwnTransform) {
  Random random(7);
  std::vector<std::uint8_t> texels(4 * 32 * 32);
  for (auto& texel : texels) texel = static_cast<std::uint8_t>(255 * random());
  SceneDescription scene;
  scene.textures = {
      std::make_shared<render::Texture>(render::make_texture(32, 32, 4, false, texels))};
  using P = StandardParameters;
  const std::vector<std::pair<std::int32_t P::*, render::UvTransform P::*>> maps{
      {&P::base_color_texture, &P::base_color_uv},
      {&P::metallic_roughness_texture, &P::metallic_roughness_uv},
      {&P::normal_texture, &P::normal_uv},
      {&P::clearcoat_texture, &P::clearcoat_uv},
      {&P::transmission_texture, &P::transmission_uv},
      {&P::emission_texture, &P::emission_uv},
      {&P::clearcoat_roughness_texture, &P::clearcoat_roughness_uv},
      {&P::alpha_texture, &P::alpha_uv}};
  const auto all_of = [](const StandardSurface& s) {
    return std::array{s.base.x,     s.metallic, s.roughness,           s.clearcoat,
                      s.normal.x,   s.normal.y, s.clearcoat_roughness, s.transmission,
                      s.emission.x, s.alpha};
  };
  for (int trial = 0; trial < 200; ++trial) {
    const auto turn = [&] { return 8 * random() - 4; };
    const render::UvTransform uv{{turn(), turn(), random()}, {turn(), turn(), random()}};
    HitPoint hit = hit_at(random());
    hit.v = random();
    HitPoint there = hit;  // where the mesh's coordinates are those of the transform
    there.u = uv.u[0] * hit.u + uv.u[1] * hit.v + uv.u[2];
    there.v = uv.v[0] * hit.u + uv.v[1] * hit.v + uv.v[2];
    there.u_slope = hit.u_slope * uv.u[0] + hit.v_slope * uv.u[1];
    there.v_slope = hit.u_slope * uv.v[0] + hit.v_slope * uv.v[1];
    const float wide = trial % 2 == 0 ? 0 : 0.05F;
    const render::Spread footprint{{wide, 0.1F * wide, 0}, {0, wide * random(), 0}};
    for (const auto& [texture, place] : maps) {
      P p;
      p.metallic = p.roughness = p.clearcoat = p.clearcoat_roughness = p.transmission = 1;
      p.emission[0] = 1;
      p.*texture = 0;
      const auto expected = all_of(standard_surface(p, scene, there, footprint));
      const float expected_alpha = standard_alpha(p, scene, there);
      p.*place = uv;
      const auto found = all_of(standard_surface(p, scene, hit, footprint));
      // Of wide ones the number of look-ups may go by rounding.
      for (std::size_t k = 0; k < found.size(); ++k) {
        EXPECT_NEAR(found[k], expected[k], wide > 0 ? 0.03 : 2e-4) << trial << " " << k;
      }
      EXPECT_NEAR(standard_alpha(p, scene, hit), expected_alpha, 2e-4);
      // The same of a mesh whose second coordinates these are.
      HitPoint second = hit;
      second.has_second_uvs = true;
      second.second_uv = {hit.u, hit.v};
      second.second_u_slope = hit.u_slope, second.second_v_slope = hit.v_slope;
      second.u = second.v = 0.3F;
      second.u_slope = second.v_slope = {};
      (p.*place).second = 1;
      EXPECT_EQ(all_of(standard_surface(p, scene, second, footprint)), found);
      EXPECT_EQ(all_of(standard_surface(p, scene, hit, footprint)), found) << "which has none";
    }
  }
}

TEST(StandardSurface, IsRougherTheMoreNormalsAFootprintHolds) {
  // Two slopes of 0.2, one to each side.
  const SceneDescription scene = scene_with_texture({102, 128, 252}, {153, 128, 252});
  StandardParameters parameters;
  parameters.roughness = 0.1F;
  parameters.normal_texture = 0;
  const auto square = [](float width_m) {
    return render::Spread{{width_m, 0, 0}, {0, width_m, 0}};
  };
  const auto surface = [&](float width_m) {
    return standard_surface(parameters, scene, hit_at(0.25F), square(width_m));
  };
  EXPECT_NEAR(surface(0).roughness, 0.1, 1e-6);
  EXPECT_LT(surface(0).normal.x, -0.15F);
  const StandardSurface far = surface(4);
  EXPECT_NEAR(far.normal.x, 0, 0.01);
  // alpha^2 = .01^2 + 2 * .2^2 / 2, the variance being along one axis of two.
  EXPECT_NEAR(std::pow(far.roughness, 4), 0.04, 0.006);
  EXPECT_GT(surface(1).roughness, 0.1F);
  EXPECT_LE(surface(1).roughness, far.roughness * 1.001F);
  // What is flat stays as smooth as it is.
  const SceneDescription flat = scene_with_texture({128, 128, 255}, {128, 128, 255});
  EXPECT_NEAR(standard_surface(parameters, flat, hit_at(0.25F), square(4)).roughness, 0.1, 1e-4);
}

TEST(StandardSurface, ShowsLessDiffuseLightTheMoreNormalsAFootprintHolds) {
  // Slopes of .75 to both sides: a mean normal of length .8.
  const SceneDescription scene = scene_with_texture({51, 128, 230}, {204, 128, 230});
  const auto facing = [&](float width_m, float scale) {
    StandardParameters parameters;
    parameters.normal_texture = 0;
    parameters.normal_scale = scale;
    const render::Spread square{{width_m, 0, 0}, {0, width_m, 0}};
    const StandardSurface surface = standard_surface(parameters, scene, hit_at(0.25F), square);
    const float white = render::standard_weights(surface, {0, 0, 1}).diffuse.x;
    StandardSurface flat = surface;
    flat.facing = 1;
    EXPECT_NEAR(white, surface.facing * render::standard_weights(flat, {0, 0, 1}).diffuse.x, 1e-6);
    return surface.facing;
  };
  EXPECT_EQ(facing(0, 1), 1);
  // A sun straight above shows .8 of what a flat surface would, half a sky .9.
  EXPECT_NEAR(facing(4, 1), 0.85, 0.01);
  // Half the slopes: a mean of length 1 / hypot(1, .375) = .936.
  EXPECT_NEAR(facing(4, 0.5F), (1 + 3 * 0.936) / 4, 0.015);
  EXPECT_EQ(facing(4, 0), 1);
}

}  // namespace
}  // namespace render::standard_test
