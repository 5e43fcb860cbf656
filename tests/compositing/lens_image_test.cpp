// A glass lens images things where the lensmaker's equation says: in the kernel, in the reference,
// and, as a real image on a screen, in the photograph.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/compositing/made_glass.h"
#include "tests/render/plain_shapes.h"
#include "tests/render/sun_and_sky.h"

namespace compositing::lens_image_test {
namespace {

using render::Mesh;
using render::Vec3f;

// Biconvex, about the origin, its axis along y.
struct Lens {
  double index = 1.5, radius_m = 1, thickness_m = 0.1, aperture_m = 0.15;

  // Hecht, "Optics", section 6.1: focal length and principal planes of a thick lens in air.
  double focal_length() const {
    const double n = index, r = radius_m, d = thickness_m;
    return 1 / ((n - 1) * (2 / r - (n - 1) * d / (n * r * r)));
  }
  // Of a principal plane, from the lens's middle.
  double principal() const {
    return thickness_m / 2 - focal_length() * (index - 1) * thickness_m / (index * radius_m);
  }
  // From the middle, of an object so far from it.
  double image_distance(double object) const {
    const double f = focal_length();
    return 1 / (1 / f - 1 / (object - principal())) + principal();
  }
  double magnification(double object) const {
    return -(image_distance(object) - principal()) / (object - principal());
  }

  std::shared_ptr<const Mesh> mesh() const {
    auto mesh = std::make_shared<Mesh>();
    constexpr int rings = 48, spokes = 192;
    const auto ring = [&](double y, double rho, auto&& normal) {
      for (int i = 0; i <= spokes; ++i) {
        const double turn = 2 * std::numbers::pi * (i % spokes) / spokes;
        const auto c = static_cast<float>(std::cos(turn)), s = static_cast<float>(std::sin(turn));
        const auto [along, across] = normal();
        mesh->positions.push_back(
            {static_cast<float>(rho) * c, static_cast<float>(y), static_cast<float>(rho) * s});
        mesh->normals.push_back({static_cast<float>(across) * c, static_cast<float>(along),
                                 static_cast<float>(across) * s});
      }
    };
    // From the front's middle (-y) over the rim to the back's; creases have two rings.
    const double middle = radius_m - thickness_m / 2;  // of the front's sphere
    const auto face = [&](double rho, double side) {
      const double rise = std::sqrt(radius_m * radius_m - rho * rho);
      ring(side * (rise - middle), rho,
           [&] { return std::pair(side * rise / radius_m, rho / radius_m); });
      return side * (rise - middle);
    };
    for (int j = 0; j <= rings; ++j) face(aperture_m * j / rings, -1);
    const double edge = std::sqrt(radius_m * radius_m - aperture_m * aperture_m) - middle;
    for (const double y : {-edge, edge}) ring(y, aperture_m, [] { return std::pair(0.0, 1.0); });
    for (int j = rings; j >= 0; --j) face(aperture_m * j / rings, 1);
    constexpr std::uint32_t row = spokes + 1;
    for (std::uint32_t j = 0; j + 1 < 2 * rings + 4; ++j) {
      if (j == rings || j == rings + 2) continue;  // between the rings of a crease
      for (std::uint32_t i = 0; i < spokes; ++i) {
        const std::uint32_t a = j * row + i, b = a + row;
        mesh->triangles.push_back({a, b + 1, a + 1});
        mesh->triangles.push_back({a, b, b + 1});
      }
    }
    mesh->materials = {0};
    return mesh;
  }

  // Slope dx/dy with which a ray in the plane z = 0 leaves the lens, and where (x, y).
  struct Ray {
    double x, y, slope;
  };
  Ray refract(Ray ray) const {
    const double middle = radius_m - thickness_m / 2;
    for (const double side : {-1.0, 1.0}) {
      const double l = std::hypot(ray.slope, 1), dx = ray.slope / l, dy = 1 / l;
      // Front: the sphere about y = middle, met first; back: about -middle, met last.
      const double cy = -side * middle, px = ray.x, py = ray.y - cy;
      const double b = px * dx + py * dy, c = px * px + py * py - radius_m * radius_m;
      const double t = -b + side * std::sqrt(b * b - c);
      const double x = ray.x + t * dx, y = ray.y + t * dy;
      const double nx = side * x / radius_m, ny = side * (y - cy) / radius_m;  // along the ray
      const double ratio = side < 0 ? 1 / index : index;
      const double cosine = nx * dx + ny * dy;
      const double after = std::sqrt(1 - ratio * ratio * (1 - cosine * cosine));
      const double ex = ratio * dx + (after - ratio * cosine) * nx;
      const double ey = ratio * dy + (after - ratio * cosine) * ny;
      ray = {x, y, ex / ey};
    }
    return ray;
  }
};

constexpr double object_m = 3, patch_x = 0.02, patch_half = 0.02;

// The lens before a black world with one glowing patch behind it (+y), seen by a camera that looks
// along y.
GlassShot lens_shot(const Lens& lens, int size, double focal_px, calibrate::Vec3 from) {
  render::SceneDescription scene =
      bodies({lens.mesh()}, {{.index = static_cast<float>(lens.index)}});
  render::StandardParameters glow;
  std::fill_n(glow.base_color, 3, 0.0F);
  glow.specular = 0;
  glow.emission[0] = glow.emission[1] = glow.emission[2] = 1;
  scene.materials.push_back(render::make_standard_material("glow", glow));
  auto patch = std::make_shared<Mesh>();
  constexpr auto s = static_cast<float>(patch_half), x = static_cast<float>(patch_x),
                 y = static_cast<float>(object_m);
  patch->positions = {{x - s, y, -s}, {x + s, y, -s}, {x + s, y, s}, {x - s, y, s}};
  patch->triangles = {{0, 1, 2}, {0, 2, 3}};
  patch->materials = {1};
  scene.meshes.push_back(patch);
  scene.instances.emplace_back().mesh = 1;
  GlassShot shot = glass_shot(
      std::move(scene), [](Vec3f) { return 0.0F; }, size, focal_px, from);
  shot.job.cam_from_set = calibrate::look_at(from, from + calibrate::Vec3{0, 1, 0}, 0);
  return shot;
}

// dx/dy towards the middle of what glows in a picture.
double slope_of(const capture::Image& picture, double focal_px) {
  double sum = 0, moment = 0;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const double seen = picture.at(y, x, 0);
      if (seen < 0.1) continue;  // mirrored twice inside the lens
      sum += seen;
      moment += seen * (x - (picture.width - 1) / 2.0);
    }
  }
  return moment / sum / focal_px;
}

TEST(GlassLens, ShowsAPatchWhereTheLensmakersEquationSays) {
  const Lens lens;
  constexpr double camera_m = 4.5, aside_m = 0.03, focal_px = 2000;
  const auto expect_image = [&](const std::string& who, auto&& picture_of) {
    std::array<double, 2> slopes{};
    for (const int side : {0, 1}) {
      const double x = side == 0 ? -aside_m : aside_m;
      const GlassShot shot = lens_shot(lens, 97, focal_px, {x, -camera_m, 0});
      slopes[static_cast<std::size_t>(side)] = slope_of(picture_of(shot), focal_px);
      // The ray that the spheres send to the patch's middle, in double.
      double low = -0.05, high = 0.05;
      for (int i = 0; i < 60; ++i) {
        const double slope = 0.5 * (low + high);
        const Lens::Ray out = lens.refract({x, -camera_m, slope});
        (out.x + out.slope * (object_m - out.y) > patch_x ? low : high) = slope;
      }
      EXPECT_NEAR(slopes[static_cast<std::size_t>(side)] * focal_px, low * focal_px, 0.1) << who;
    }
    // Where both lines of sight meet.
    const double distance = 2 * aside_m / (slopes[0] - slopes[1]);
    const double image = lens.image_distance(object_m);
    EXPECT_NEAR((camera_m - distance) / image, 1, 0.005) << who;
    const double x = aside_m + slopes[1] * distance;
    EXPECT_NEAR(x / (patch_x * lens.magnification(object_m)), 1, 0.01) << who;
  };
  expect_image("kernel", [](const GlassShot& shot) { return shot.kernel(); });
  expect_image("reference", [](const GlassShot& shot) { return shot.reference(64); });
}

// A screen in the image plane, seen from the lens's side: its light has passed the lens.
TEST(GlassLens, ThrowsARealImageOnAScreen) {
  const Lens lens;
  const double image_m = lens.image_distance(object_m), m = lens.magnification(object_m);
  const GlassShot made = lens_shot(lens, 1, 4000, {0, -1, 0});
  render::SceneDescription description = made.scene->description();
  render::StandardParameters matte;
  matte.roughness = 1;
  matte.specular = 0;
  description.materials.push_back(render::make_standard_material("screen", matte));
  auto screen = std::make_shared<Mesh>();
  const auto y = static_cast<float>(-image_m);
  screen->positions = {{-1, y, -1}, {1, y, -1}, {1, y, 1}, {-1, y, 1}};
  screen->triangles = {{0, 1, 2}, {0, 2, 3}};
  screen->materials = {2};
  description.meshes.push_back(screen);
  description.instances.emplace_back().mesh = 2;
  const render::Scene scene(description);
  const render::Environment dark = render::make_even_environment(0, 8);
  const auto radiance_at = [&](double x, double z) {
    const auto directions = render::make_pinhole_directions(1, 1, 8000);
    const calibrate::Pose pose = calibrate::look_at({0.7, -image_m + 0.6, 0}, {x, -image_m, z}, 0);
    return render::photograph({.scene = &scene, .directions = &directions, .environment = &dark},
                              pose, {.samples = 1 << 17})
        .at(0, 0, 0);
  };
  // All of the lens, seen from there, has the patch's radiance, less what its two faces mirror. The
  // outermost ray passes the rim of the far one.
  double low = 0, high = 0.15;
  for (int i = 0; i < 60; ++i) {
    const double slope = 0.5 * (low + high);
    (lens.refract({0, -image_m, slope}).x > lens.aperture_m ? high : low) = slope;
  }
  const double f = std::pow((lens.index - 1) / (lens.index + 1), 2);
  const double expected = std::pow(std::sin(std::atan(low)), 2) * (1 - f) / (1 + f);
  const double middle = radiance_at(patch_x * m, 0);
  EXPECT_NEAR(middle / expected, 1, 0.03);
  // Its edges are where they should be, but for the lens's own spherical aberration.
  for (const double side : {-1.0, 1.0}) {
    EXPECT_NEAR(radiance_at((patch_x + side * 0.5 * patch_half) * m, 0) / middle, 1, 0.1) << side;
    EXPECT_LT(radiance_at((patch_x + side * 1.5 * patch_half) * m, 0), 0.05 * middle) << side;
  }
}

}  // namespace
}  // namespace compositing::lens_image_test
