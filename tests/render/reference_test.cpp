// The reference: laws of light that it must keep.
#include "render/reference.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <string>

#include "calibrate/angles.h"
#include "plain_shapes.h"
#include "sun_and_sky.h"

namespace render::reference_test {
namespace {

using calibrate::pi_f;

struct Shot {
  calibrate::DirectionTable directions;
  FrameJob job;

  Shot(int width, int height, double focal_px, calibrate::Vec3 from, calibrate::Vec3 at)
      : directions(make_pinhole_directions(width, height, focal_px)) {
    job.cam_from_set = calibrate::look_at(from, at, 0);
  }
  capture::Image reference(const Scene& scene,
                           const Environment& environment,
                           const ReferenceSettings& settings) const {
    const capture::Image plate = capture::make_image(directions.height, directions.width);
    return render_reference({&scene, &directions, &environment}, job, plate, settings);
  }
  capture::Image photo(const Scene& scene,
                       const Environment& environment,
                       const ReferenceSettings& settings) const {
    return photograph({&scene, &directions, &environment}, job.cam_from_set, settings);
  }
};

ReferenceSettings with_samples(int samples, bool bounces = false) {
  ReferenceSettings settings;
  settings.samples = samples;
  settings.bounces = bounces;
  return settings;
}

struct Mean {
  double value = 0, largest = 0;
};
Mean mean_of(const capture::Image& picture) {
  Mean mean;
  std::size_t count = 0;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      for (int c = 0; c < 3; ++c, ++count) {
        mean.value += picture.at(y, x, c);
        mean.largest = std::max<double>(mean.largest, picture.at(y, x, c));
      }
    }
  }
  mean.value /= static_cast<double>(count);
  return mean;
}

struct NamedSurface {
  std::string name;
  StandardParameters parameters;
};
std::vector<NamedSurface> white_surfaces() {
  std::vector<NamedSurface> surfaces;
  const auto add = [&](const std::string& name) -> StandardParameters& {
    return surfaces.emplace_back(NamedSurface{name, {}}).parameters;
  };
  add("matte").roughness = 1;
  add("smooth plastic").roughness = 0;
  auto& rough_metal = add("rough metal");
  rough_metal.metallic = 1;
  rough_metal.roughness = 0.6F;
  auto& mirror = add("mirror");
  mirror.metallic = 1;
  mirror.roughness = 0;
  auto& paint = add("coated paint");
  paint.clearcoat = 1;
  paint.roughness = 0.4F;
  auto& satin = add("rough coat on half metal");
  satin.clearcoat = 0.7F;
  satin.clearcoat_roughness = 0.3F;
  satin.metallic = 0.5F;
  auto& glass = add("glass");
  glass.transmission = 1;
  glass.roughness = 0;
  auto& milk_glass = add("rough half-clear glass");
  milk_glass.transmission = 0.5F;
  milk_glass.roughness = 0.5F;
  auto& veil = add("half-opaque metal");
  veil.opacity = 0.5F;
  veil.metallic = 0.5F;
  return surfaces;
}

TEST(RenderReference, KeepsAWhiteFurnaceWhite) {
  const Environment even = make_even_environment(1, 32);
  const Shot shot(24, 24, 40, {0, -4, 1}, {0, 0, 0});
  for (const auto& [name, parameters] : white_surfaces()) {
    SceneDescription description = make_scene(make_sphere(1, 96), parameters);
    const Scene scene(description);
    if ((parameters.transmission == 0 || parameters.transmission == 1) && parameters.opacity == 1) {
      // Half-clear glass has a diffuse inside, which only bounces can light.
      const Mean mean = mean_of(shot.reference(scene, even, with_samples(64)));
      EXPECT_NEAR(mean.value, 1, 0.005) << name;
    }
    const Mean all = mean_of(shot.photo(scene, even, with_samples(64)));
    EXPECT_NEAR(all.value, 1, 0.005) << name << ", with bounces";
  }
}

TEST(RenderReference, ShadesAPlaneAsItsIntegralSays) {
  SunAndSky made;
  made.sun_radius_rad = 0.1F;
  const Environment sky = make_sun_and_sky(made, 128);
  StandardParameters p;
  p.base_color[0] = 0.6F;
  p.base_color[1] = 0.3F;
  p.base_color[2] = 0.1F;
  p.roughness = 0;
  const Scene scene(make_scene(make_square(5), p));
  const Shot shot(1, 1, 400, {2, 0, 2}, {0, 0, 0});
  const capture::Image picture = shot.reference(scene, sky, with_samples(16384));
  StandardSurface surface{};
  surface.base = {0.6F, 0.3F, 0.1F};
  surface.normal = surface.coat_normal = {0, 0, 1};
  const Vec3f view = normalize(Vec3f{1, 0, 1});
  const StandardWeights w = standard_weights(surface, view);
  const Vec3f irradiance = irradiance_of(sky, {0, 0, 1});
  const Vec3f mirrored_sky = radiance_of(sky, normalize(Vec3f{-1, 0, 1}), 0);
  EXPECT_NEAR(picture.at(0, 0, 0),
              w.diffuse.x * irradiance.x / pi_f + w.specular.x * mirrored_sky.x, 0.004);
  EXPECT_NEAR(picture.at(0, 0, 2),
              w.diffuse.z * irradiance.z / pi_f + w.specular.z * mirrored_sky.z, 0.004);
}

TEST(RenderReference, SplitsTwoSurfacesIntoTheirLobesAsTheirIntegralsSay) {
  SunAndSky made;
  made.sun_radius_rad = 0.1F;
  const Environment sky = make_sun_and_sky(made, 128);
  StandardParameters paint;
  paint.base_color[1] = 0.3F;
  paint.roughness = 0;
  StandardParameters glass;
  glass.transmission = 1;
  glass.roughness = 0;
  glass.base_color[1] = 0.7F;
  SceneDescription description = make_scene(make_square(5), paint);
  auto pane = std::make_shared<Mesh>(*make_square(0.03F));
  pane->materials = {1};
  description.materials.push_back(make_standard_material("glass", glass));
  description.meshes.push_back(pane);
  // So near the camera, and so small, that it hides none of the floor's light.
  description.instances.emplace_back().mesh = 1;
  description.instances[1].set_from_object = {1, 0, 0, 1.9F, 0, 1, 0, 0, 0, 0, 1, 1.9F};
  const Scene scene(description);
  const Shot shot(1, 1, 400, {2, 0, 2}, {0, 0, 0});

  StandardSurface surface{};
  surface.base = {1, 0.3F, 1};
  surface.normal = surface.coat_normal = {0, 0, 1};
  const Vec3f view = normalize(Vec3f{1, 0, 1});
  const float mirrored_sky = radiance_of(sky, normalize(Vec3f{-1, 0, 1}), 0).y;
  const StandardWeights floor = standard_weights(surface, view);
  const float floor_light =
      floor.diffuse.y * irradiance_of(sky, {0, 0, 1}).y / pi_f + floor.specular.y * mirrored_sky;
  surface.base = {1, 0.7F, 1};
  surface.transmission = 1;
  const StandardWeights through = standard_weights(surface, view);
  const float expected = through.specular.y * mirrored_sky + through.transmission.y * floor_light;
  ReferenceSettings settings = with_samples(4096);
  double mean = 0;
  for (const std::uint32_t seed : {1U, 2U, 3U, 4U}) {
    settings.seed = seed;
    mean += shot.reference(scene, sky, settings).at(0, 0, 1) / 4;
  }
  EXPECT_NEAR(mean / expected, 1, 0.01);
}

TEST(RenderReference, GathersALobeAsItsIntegralSays) {
  SunAndSky made;
  made.sun_radius_rad = 0.06F;
  made.sun_azimuth_rad = pi_f;  // before the camera, so that its reflection is near
  made.sun_elevation_rad = 0.9F;
  const Environment sky = make_sun_and_sky(made, 128);
  for (const float roughness : {0.15F, 0.3F, 0.7F}) {
    StandardParameters p;
    p.metallic = 1;
    p.roughness = roughness;
    const Scene scene(make_scene(make_square(5), p));
    const Shot shot(1, 1, 400, {2, 0, 2}, {0, 0, 0});
    const capture::Image picture = shot.reference(scene, sky, with_samples(16384));
    const Vec3f view = normalize(Vec3f{1, 0, 1});
    double expected = 0;
    constexpr int rows = 512;
    for (int y = 0; y < rows / 2; ++y)
      for (int x = 0; x < 2 * rows; ++x) {
        const Vec3f l =
            direction_of_texel(static_cast<float>(x), static_cast<float>(y), 2 * rows, rows);
        expected += lobe_density({0, 0, 1}, view, roughness, l) * radiance_of(sky, l, 0).y *
                    texel_solid_angle(y, 2 * rows, rows);
      }
    EXPECT_NEAR(picture.at(0, 0, 1) / expected, 1, 0.01) << "roughness " << roughness;
  }
}

TEST(RenderReference, IsTheSameForAnyNumberOfThreadsAndDiffersBySeed) {
  const Environment sky = make_sun_and_sky({}, 32);
  const Scene scene(make_scene(make_sphere(1, 16), {}));
  const Shot shot(16, 12, 20, {0, -4, 1}, {0, 0, 0});
  const ReferenceSettings settings = with_samples(4, true);
  const capture::Image many = shot.reference(scene, sky, settings);
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(shot.reference(scene, sky, settings).pixels, many.pixels);
  }
  ReferenceSettings other = settings;
  other.seed = 2;
  EXPECT_NE(shot.reference(scene, sky, other).pixels, many.pixels);
}

double rms_difference(const capture::Image& a, const capture::Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i)
    sum += (a.pixels[i] - b.pixels[i]) * (a.pixels[i] - b.pixels[i]);
  return std::sqrt(sum / static_cast<double>(a.pixels.size()));
}

TEST(RenderReference, ConvergesAtLeastWithTheRootOfItsSamplesToOnePictureOfAllSeeds) {
  SunAndSky made;
  made.sun_radius_rad = 0.4F;  // a smaller one's rare reflections would ask for many more samples
  const Environment sky = make_sun_and_sky(made, 64);
  StandardParameters paint;
  paint.clearcoat = 1;
  paint.roughness = 0.4F;
  SceneDescription description = make_scene(make_sphere(1, 48), paint);
  description.meshes.push_back(make_square(3, -1));
  description.instances.emplace_back().mesh = 1;
  const Scene scene(description);
  const Shot shot(20, 16, 20, {0, -4, 2}, {0, 0, -0.3});
  for (const bool bounces : {false, true}) {
    ReferenceSettings settings = with_samples(2048, bounces);
    settings.seed = 77;
    const capture::Image truth = shot.reference(scene, sky, settings);
    settings.seed = 5;
    std::vector<double> errors;
    for (const int samples : {4, 16, 64, 256}) {
      settings.samples = samples;
      errors.push_back(rms_difference(shot.reference(scene, sky, settings), truth));
    }
    EXPECT_LT(errors[1], 0.6 * errors[0]) << bounces;
    EXPECT_LT(errors[2], 0.6 * errors[1]) << bounces;
    EXPECT_LT(errors[3], 0.6 * errors[2]) << bounces;
  }
}

TEST(Photograph, AddsNoLightToAnEvenOne) {
  StandardParameters p;
  p.clearcoat = 0.5F;
  p.base_color[0] = p.base_color[1] = p.base_color[2] = 0.9F;
  SceneDescription description = make_scene(make_square(2), p);
  description.meshes.push_back(make_box({-0.5F, -0.5F, 0}, {0.5F, 0.5F, 1}));
  description.instances.emplace_back().mesh = 1;
  const Scene scene(description);
  const Environment even = make_even_environment(1, 16);
  const Shot shot(16, 16, 16, {2, -3, 2}, {0, 0, 0.3});
  const Mean mean = mean_of(shot.photo(scene, even, with_samples(256)));
  EXPECT_LT(mean.largest, 1.005);
  EXPECT_GT(mean.value, 0.7);
}

TEST(Photograph, BouncesLightWhereTheReferenceWithoutBouncesIsBlack) {
  // Under a roof only bounced light arrives.
  StandardParameters white;
  SceneDescription description = make_scene(make_square(3), white);
  description.meshes.push_back(make_square(3, 1));
  description.instances.emplace_back().mesh = 1;
  const Scene scene(description);
  SunAndSky made;
  const Environment sky = make_sun_and_sky(made, 32);
  const Shot shot(4, 4, 40, {0, -1, 0.5}, {0, 0, 0});
  EXPECT_GT(mean_of(shot.photo(scene, sky, with_samples(256))).value,
            1.5 * mean_of(shot.reference(scene, sky, with_samples(256))).value);
}

TEST(RenderReference, LightsASurfaceByTheLawOfTheInverseSquare) {
  StandardParameters p;
  p.roughness = 1;
  const Scene scene(make_scene(make_square(5), p));
  const Environment dark = make_even_environment(0, 8);
  Shot shot(1, 1, 4000, {0, 0, 5}, {0, 0, 0});
  shot.job.lights.lamps.push_back({{0, 0, 2}, {}, {8, 8, 8}});
  const capture::Image picture = shot.reference(scene, dark, with_samples(64));
  StandardSurface surface{};
  surface.base = {1, 1, 1};
  surface.normal = surface.coat_normal = {0, 0, 1};
  const float diffuse = standard_weights(surface, {0, 0, 1}).diffuse.x;
  EXPECT_NEAR(picture.at(0, 0), diffuse * 8 / 4 / pi_f, 1e-3);
}

TEST(RenderReference, StaysFiniteUnderAnOddSky) {
  Environment odd = make_even_environment(0.5F, 16);
  odd.radiance.at(3, 3, 0) = NAN;
  odd.radiance.at(4, 9, 1) = -1e9F;
  odd.radiance.at(5, 5, 2) = 1e6F;
  StandardParameters p;
  p.clearcoat = 1;
  const Scene scene(make_scene(make_sphere(1, 16), p));
  const Shot shot(12, 12, 12, {0, -3, 0}, {0, 0, 0});
  for (const float value : shot.reference(scene, odd, with_samples(16, true)).pixels)
    ASSERT_TRUE(std::isfinite(value));
}

TEST(RenderReference, RefusesAPlateOfAnotherSizeAndNoSamples) {
  const Environment even = make_even_environment(1, 8);
  const Scene scene(make_scene(make_square(1), {}));
  const Shot shot(4, 4, 4, {0, -3, 1}, {0, 0, 0});
  const FrameInputs inputs{&scene, &shot.directions, &even};
  EXPECT_THROW(render_reference(inputs, shot.job, capture::make_image(4, 5), {}),
               std::invalid_argument);
  EXPECT_THROW(shot.reference(scene, even, with_samples(0)), std::invalid_argument);
}

}  // namespace
}  // namespace render::reference_test
