// The reference against closed forms and quadrature of the test's own: all materials in a white
// furnace, planes under a made sky, glowing shapes.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "plain_shapes.h"
#include "render/glass.h"
#include "render/light_table.h"
#include "render/made_sky.h"
#include "render/reference.h"
#include "sun_and_sky.h"

namespace render::reference_proof_test {
namespace {

using std::numbers::pi;

// One pixel that sees the origin from `from`, a few millimetres of it.
struct Look {
  calibrate::DirectionTable directions = make_pinhole_directions(1, 1, 4000);
  FrameJob job;
  capture::Image plate = capture::make_image(1, 1);

  explicit Look(Vec3f from) {
    job.cam_from_set = calibrate::look_at(to_double(from), {0, 0, 0}, 0);
  }
  Vec3f reference(const Scene& scene, const Environment& environment, int samples) const {
    return colour(
        render_reference({&scene, &directions, &environment}, job, plate, {.samples = samples}));
  }
  Vec3f photo(const Scene& scene, const Environment& environment, int samples) const {
    return colour(
        photograph({&scene, &directions, &environment}, job.cam_from_set, {.samples = samples}));
  }
  static Vec3f colour(const capture::Image& picture) {
    return {picture.at(0, 0, 0), picture.at(0, 0, 1), picture.at(0, 0, 2)};
  }
};

struct NamedSurface {
  std::string name;
  StandardParameters parameters;
};

// Every kind of ground, bare and under a clear and a rough coat.
std::vector<NamedSurface> all_surfaces(float base) {
  struct Ground {
    std::string name;
    float metallic, specular, roughness, transmission;
  };
  const std::vector<Ground> grounds{{"matte", 0, 0, 1, 0},
                                    {"smooth plastic", 0, 1, 0, 0},
                                    {"rough plastic", 0, 1, 0.4F, 0},
                                    {"mirror", 1, 1, 0, 0},
                                    {"satin metal", 1, 1, 0.15F, 0},
                                    {"rough metal", 1, 1, 0.6F, 0},
                                    {"half metal", 0.5F, 1, 0.3F, 0},
                                    {"thin glass", 0, 1, 0, 1},
                                    {"frosted thin glass", 0, 1, 0.3F, 0.5F}};
  std::vector<NamedSurface> surfaces;
  for (const Ground& ground : grounds) {
    for (const float coat_roughness : {-1.0F, 0.0F, 0.3F}) {
      StandardParameters p;
      p.base_color[0] = base;
      p.base_color[1] = 0.5F * base;
      p.base_color[2] = 0;
      p.metallic = ground.metallic;
      p.specular = ground.specular;
      p.roughness = ground.roughness;
      p.transmission = ground.transmission;
      p.clearcoat = coat_roughness < 0 ? 0.0F : 0.8F;
      p.clearcoat_roughness = std::max(coat_roughness, 0.0F);
      const char* coat = coat_roughness < 0    ? ""
                         : coat_roughness == 0 ? ", clear coat"
                                               : ", rough coat";
      surfaces.push_back({ground.name + coat, p});
    }
  }
  return surfaces;
}

// In an even light of 1 a plane shows the sum of its weights: 1 where its base is white.
TEST(RenderReference, ShowsTheWeightsOfEverySurfaceInAFurnaceAtEveryAngle) {
  const Environment even = make_even_environment(1, 32);
  for (const float base : {1.0F, 0.6F}) {
    for (const auto& [name, parameters] : all_surfaces(base)) {
      const Scene scene(make_scene(make_square(5), parameters));
      for (const float cosine : {1.0F, 0.6F, 0.2F, 0.05F}) {
        const Vec3f view{std::sqrt(1 - cosine * cosine), 0, cosine};
        const Look look(view * 2);
        StandardSurface surface{};
        surface.base = {base, 0.5F * base, 0};
        surface.metallic = parameters.metallic;
        surface.specular = parameters.specular;
        surface.transmission = parameters.transmission;
        surface.clearcoat = parameters.clearcoat;
        surface.normal = surface.coat_normal = {0, 0, 1};
        const StandardWeights w = standard_weights(surface, view);
        const Vec3f expected =
            Vec3f{w.coat, w.coat, w.coat} + w.specular + w.diffuse + w.transmission;
        EXPECT_NEAR(base == 1 ? expected.x : 1, 1, 1e-6);
        const Vec3f seen = look.reference(scene, even, 4096);
        EXPECT_NEAR(seen.x, expected.x, 3e-3) << name << ", cosine " << cosine;
        EXPECT_NEAR(seen.y, expected.y, 3e-3) << name << ", cosine " << cosine;
        EXPECT_NEAR(seen.z, expected.z, 3e-3) << name << ", cosine " << cosine;
        const Vec3f bounced = look.photo(scene, even, 4096);
        EXPECT_NEAR(bounced.x, expected.x, 3e-3) << name << ", with bounces, " << cosine;
        EXPECT_NEAR(bounced.y, expected.y, 3e-3) << name << ", with bounces, " << cosine;
      }
    }
  }
}

// Curved, with light that goes from one part of it to another: a bowl of every material.
TEST(Photograph, ShowsNoMoreThanTheFurnacesLightInABowlAndAllOfItWhereWhite) {
  const Environment even = make_even_environment(1, 32);
  auto bowl = std::make_shared<Mesh>(*make_sphere(1, 24));
  std::erase_if(bowl->triangles, [&](const auto& t) { return bowl->positions[t[0]].z > 0.3F; });
  const auto directions = make_pinhole_directions(6, 6, 12);
  const calibrate::Pose pose = calibrate::look_at({0.2, -1.2, 2.2}, {0, 0.2, -0.6}, 0);
  for (const float base : {1.0F, 0.6F}) {
    for (const auto& [name, parameters] : all_surfaces(base)) {
      const Scene scene(make_scene(bowl, parameters));
      const int samples = base == 1 ? 512 : 64;
      const capture::Image picture =
          photograph({&scene, &directions, &even}, pose, {.samples = samples});
      double red = 0, green = 0;
      for (int i = 0; i < 36; ++i) {
        red += picture.pixels[static_cast<std::size_t>(3 * i)] / 36;
        green += picture.pixels[static_cast<std::size_t>(3 * i + 1)] / 36;
      }
      if (base == 1) {
        EXPECT_NEAR(red, 1, 0.01) << name;
      } else {
        EXPECT_LT(red, 1) << name;
      }
      EXPECT_LT(green, red) << name;
    }
  }
}

TEST(RenderReference, KeepsAFurnaceWhiteInSolidGlassThatDispersesAndDarkensItWhereItAbsorbs) {
  const Environment even = make_even_environment(1, 32);
  const auto directions = make_pinhole_directions(12, 12, 20);
  FrameJob job;
  job.cam_from_set = calibrate::look_at({0, -4, 1}, {0, 0, 0}, 0);
  const capture::Image plate = capture::make_image(12, 12);
  const auto picture_of = [&](const GlassParameters& glass, std::shared_ptr<const Mesh> mesh) {
    SceneDescription description = make_scene(std::move(mesh), {});
    description.materials[0] = make_glass_material("glass", glass);
    const Scene scene(description);
    return render_reference({&scene, &directions, &even}, job, plate, {.samples = 256});
  };
  const auto sphere = make_sphere(1, 48), box = make_box({-1, -0.7F, -0.5F}, {1, 0.7F, 0.5F});
  for (const auto& mesh : {sphere, box}) {
    for (const float index : {1.0F, 1.33F, 1.5F, 2.4F, 4.0F}) {
      for (const float abbe : {0.0F, 20.0F}) {
        const capture::Image clear = picture_of({.index = index, .abbe = abbe}, mesh);
        const capture::Image dark =
            picture_of({.index = index, .absorption = {0, 0.5F, 5}, .abbe = abbe}, mesh);
        // Where colours part, each path follows one of them for all three: their sum is certain.
        std::array<double, 3> clear_mean{}, dark_mean{};
        for (std::size_t at = 0; at < clear.pixels.size(); at += 4) {
          double clear_sum = 0, dark_sum = 0;
          for (std::size_t c = 0; c < 3; ++c) {
            clear_sum += clear.pixels[at + c];
            dark_sum += dark.pixels[at + c];
            clear_mean[c] += clear.pixels[at + c] / 144;
            dark_mean[c] += dark.pixels[at + c] / 144;
          }
          EXPECT_NEAR(clear_sum / 3, 1, 1e-4) << index << " " << abbe;
          EXPECT_LE(dark_sum / 3, 1 + 1e-4) << index << " " << abbe;
        }
        for (const double value : clear_mean) EXPECT_NEAR(value, 1, 0.01) << index << " " << abbe;
        EXPECT_NEAR(dark_mean[0], 1, index == 1 ? 1e-4 : 0.01) << index << " " << abbe;
        if (index == 1) continue;  // is not there
        EXPECT_LT(dark_mean[1], dark_mean[0]) << index << " " << abbe;
        EXPECT_LT(dark_mean[2], dark_mean[1]) << index << " " << abbe;
      }
    }
  }
}

// In two boxes that cross, what is mirrored at their faces finds out only after many times.
TEST(RenderReference, KeepsAFurnaceWhiteInCrossedBoxesOfGlassThatHoldLightForLong) {
  const Environment even = make_even_environment(1, 32);
  const auto directions = make_pinhole_directions(8, 8, 16);
  FrameJob job;
  job.cam_from_set = calibrate::look_at({0, -2.6, 0.8}, {0.1, 0, 0.1}, 0);
  SceneDescription description =
      make_scene(make_box({-0.5F, -0.5F, -0.5F}, {0.5F, 0.5F, 0.5F}), {});
  description.background = "environment";
  description.materials[0] = make_glass_material("glass", {.index = 2.4F});
  description.instances.push_back(description.instances[0]);
  // Turned by 40 degrees about an axis that is none of the box's, and moved.
  const float c = std::cos(0.7F), s = std::sin(0.7F), e = 0.6F, g = 0.8F;
  description.instances[1].set_from_object = {c + e * e * (1 - c),
                                              e * g * (1 - c),
                                              g * s,
                                              0.2F,
                                              e * g * (1 - c),
                                              c + g * g * (1 - c),
                                              -e * s,
                                              0.1F,
                                              -g * s,
                                              e * s,
                                              c,
                                              0.3F};
  const Scene scene(description);
  const capture::Image picture = render_reference({&scene, &directions, &even}, job,
                                                  capture::make_image(8, 8), {.samples = 512});
  double sum = 0;
  for (std::size_t at = 0; at < picture.pixels.size(); at += 4) sum += picture.pixels[at] / 64;
  EXPECT_NEAR(sum, 1, 1e-3);
}

// The radiance of a map between its texels, in double: bilinear, around the sphere.
class Bilinear {
 public:
  explicit Bilinear(const capture::Image& map) : map_(map) {}

  double at(double x, double y, int c) const {
    const double left = std::floor(x), top = std::floor(y);
    const double s = x - left, t = y - top;
    const auto i = static_cast<int>(left), j = static_cast<int>(top);
    return (1 - t) * ((1 - s) * texel(i, j, c) + s * texel(i + 1, j, c)) +
           t * ((1 - s) * texel(i, j + 1, c) + s * texel(i + 1, j + 1, c));
  }

 private:
  double texel(int x, int y, int c) const {
    if (y < 0 || y >= map_.height) {  // beyond a pole: the row itself, half way around
      y = y < 0 ? 0 : map_.height - 1;
      x += map_.width / 2;
    }
    return map_.at(y, (x % map_.width + map_.width) % map_.width, c);
  }
  const capture::Image& map_;
};

// Irradiance on planes, by the midpoint rule over parts x parts of every texel.
std::vector<double> integrated_irradiance(const capture::Image& map,
                                          const std::vector<Vec3f>& normals,
                                          int c,
                                          int parts) {
  const Bilinear radiance(map);
  std::vector<double> sums(normals.size());
  for (int j = 0; j < parts * map.height; ++j) {
    const double y = (j + 0.5) / parts, theta = pi * y / map.height;
    const double upper = std::cos(pi * j / (parts * map.height));
    const double lower = std::cos(pi * (j + 1) / (parts * map.height));
    const double solid_angle = (upper - lower) * 2 * pi / (parts * map.width);
    for (int i = 0; i < parts * map.width; ++i) {
      const double x = (i + 0.5) / parts, azimuth = (0.5 - x / map.width) * 2 * pi;
      const calibrate::Vec3 l{std::sin(theta) * std::cos(azimuth),
                              std::sin(theta) * std::sin(azimuth), std::cos(theta)};
      const double light = solid_angle * radiance.at(x - 0.5, y - 0.5, c);
      for (std::size_t n = 0; n < normals.size(); ++n)
        sums[n] += light * std::max(0.0, dot(l, to_double(normals[n])));
    }
  }
  return sums;
}

Environment made_sky_of(int height, float cloudiness) {
  const MadeSky sky = make_sky({.height = height,
                                .sun_azimuth_rad = 0.6F,
                                .sun_elevation_rad = 0.7F,
                                .cloudiness = cloudiness});
  Environment environment;
  environment.radiance = sky.rest;
  for (std::size_t i = 0; i < sky.sun.pixels.size(); ++i)
    environment.radiance.pixels[i] += sky.sun.pixels[i];
  return environment;
}

const std::vector<Vec3f> tilts{
    {0, 0, 1},  normalize(Vec3f{1, 0.7F, 1}),     normalize(Vec3f{-1, 0.3F, 0.5F}),
    {0, -1, 0}, normalize(Vec3f{0.5F, 0.5F, -1}), {0, 0, -1}};

TEST(RenderReference, LightsTiltedPlanesUnderAMadeSkyAsTheIntegralSaysToAThousandth) {
  const Environment sky = made_sky_of(128, 0.5F);
  StandardParameters matte;
  matte.roughness = 1;
  matte.specular = 0;
  std::array<std::vector<double>, 3> truth;
  for (int c = 0; c < 3; ++c)
    truth[static_cast<std::size_t>(c)] = integrated_irradiance(sky.radiance, tilts, c, 6);
  for (std::size_t n = 0; n < tilts.size(); ++n) {
    const Vec3f normal = tilts[n];
    auto plane = std::make_shared<Mesh>();
    const Vec3f side = std::abs(normal.z) > 0.9F ? Vec3f{1, 0, 0} : Vec3f{0, 0, 1};
    const Vec3f x = normalize(cross(side, normal)), y = cross(normal, x);
    plane->positions = {-x - y, x - y, x + y, y - x};
    plane->triangles = {{0, 1, 2}, {0, 2, 3}};
    plane->materials = {0};
    const Scene scene(make_scene(plane, matte));
    const Vec3f seen = Look(normal * 2 + x * 0.3F).reference(scene, sky, 65536);
    for (const auto& [value, channel] :
         {std::pair(seen.x, truth[0][n]), std::pair(seen.y, truth[1][n]),
          std::pair(seen.z, truth[2][n])})
      EXPECT_NEAR(pi * value / channel, 1, 1e-3) << normal.x << " " << normal.y << " " << normal.z;
  }
}

TEST(LightTable, LightsTiltedPlanesUnderAMadeSkyWithinItsOwnBound) {
  for (const float cloudiness : {0.2F, 0.9F}) {
    const Environment sky = made_sky_of(256, cloudiness);
    std::vector<Vec3f> normals = tilts;
    for (const Vec3f n : upward_normals(10)) normals.push_back(n);
    const std::vector<double> truth = integrated_irradiance(sky.radiance, normals, 1, 2);
    for (const int count : {16, 64, 256, 1024}) {
      const LightTable table = make_light_table(sky, {.count = count});
      double errors = 0, squares = 0;
      for (std::size_t n = 0; n < normals.size(); ++n) {
        double sum = 0;
        for (const DirectionalLight& light : table.lights)
          sum += std::max(0.0F, dot(light.direction, normals[n])) * light.irradiance.y;
        errors += (sum - truth[n]) * (sum - truth[n]);
        squares += truth[n] * truth[n];
      }
      EXPECT_LE(std::sqrt(errors / squares), table.error_estimate) << count;
    }
  }
}

// Light from glowing shapes arrives as the catalogue of configuration factors says.
TEST(Photograph, LightsAFloorByAGlowingBallAndSquareAsTheirClosedFormsSay) {
  StandardParameters matte, glow;
  matte.roughness = 1;
  matte.specular = 0;
  std::fill_n(glow.base_color, 3, 0.0F);
  glow.specular = 0;
  glow.emission[0] = glow.emission[1] = glow.emission[2] = 5;
  const Environment dark = make_even_environment(0, 8);
  const auto lit_by = [&](std::shared_ptr<const Mesh> shape, Vec3f at) {
    SceneDescription description = make_scene(make_square(3), matte);
    auto mesh = std::make_shared<Mesh>(*shape);
    mesh->materials = {1};
    description.materials.push_back(make_standard_material("glow", glow));
    description.meshes.push_back(mesh);
    Instance& instance = description.instances.emplace_back();
    instance.mesh = 1;
    instance.set_from_object = {1, 0, 0, at.x, 0, 1, 0, at.y, 0, 0, 1, at.z};
    const Scene scene(description);
    return pi * Look({-2, -1, 0.7F}).photo(scene, dark, 65536).x;
  };
  // A ball above the horizon: pi L (R / D)^2 cos.
  for (const float x : {0.0F, 0.8F, 1.6F}) {
    const double distance2 = x * x + 1.5 * 1.5;
    const double truth = pi * 5 * 0.25 / distance2 * (1.5 / std::sqrt(distance2));
    EXPECT_NEAR(lit_by(make_sphere(0.5F, 64), {x, 0, 1.5F}) / truth, 1, 5e-3) << x;
  }
  // Under the middle of a square (Howell, "A Catalog of Radiation Heat Transfer Configuration
  // Factors", B-3, four times).
  for (const float half : {0.2F, 0.5F, 1.0F}) {
    const double x = half, root = std::sqrt(1 + x * x);
    const double truth = 5 * pi * 4 * (2 * x / root * std::atan(x / root)) / (2 * pi);
    EXPECT_NEAR(lit_by(make_square(half), {0, 0, 1}) / truth, 1, 5e-3) << half;
  }
}

}  // namespace
}  // namespace render::reference_proof_test
