// Light from real maps and from the real fish-eye bracket, against what was measured in them by
// hand.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>

#include "calibrate/angles.h"
#include "capture/make_hdr.h"
#include "capture/rgbe.h"
#include "render/light_table.h"
#include "render/probe.h"
#include "tests/render/made_shading.h"

namespace render::real_light_test {
namespace {

using calibrate::degree;

std::filesystem::path real_data() {
  const char* place = std::getenv("PLATELIGHT_DATA");
  return place != nullptr ? place : PLATELIGHT_SOURCE_DIR "/../shared/data";
}

const DirectionalLight& brightest(const LightTable& table) {
  return *std::max_element(table.lights.begin(), table.lights.end(),
                           [](const DirectionalLight& a, const DirectionalLight& b) {
                             return a.irradiance.y < b.irradiance.y;
                           });
}

double elevation_deg(Vec3f d) { return std::asin(d.z) / degree; }

TEST(RealMaps, HaveTheirSunsWhereTheyWereMeasured) {
  struct Known {
    const char* name;
    double upward_irradiance;
    std::optional<double> sun_elevation_deg;  // of maps with one main light
  };
  const auto directory = real_data() / "env";
  if (!std::filesystem::exists(directory)) GTEST_SKIP() << "no real data at " << directory;
  for (const Known& known :
       {Known{"park", 1.97, 10.4}, Known{"sky", 4.79, 48}, Known{"sunrise", 2.75, 7.9},
        Known{"studio", 13.9, 43}, Known{"warehouse", 3.77, {}}, Known{"lobby", 3.22, {}}}) {
    SCOPED_TRACE(known.name);
    const capture::Image map = capture::read_rgbe(directory / (std::string(known.name) + ".hdr"));
    const Environment env = environment_from_map(map, 0, 256);
    const LightTable table = make_light_table(env, {});
    if (known.sun_elevation_deg) {
      EXPECT_NEAR(elevation_deg(brightest(table).direction), *known.sun_elevation_deg, 1.5);
    }
    const Vec3f up = irradiance_of(env, {0, 0, 1});
    EXPECT_NEAR(luminance(up.x, up.y, up.z), known.upward_irradiance,
                0.02 * known.upward_irradiance);
    const auto surfaces = shaded_surfaces(100);
    EXPECT_LE(relative_rms(shade_by_table(table, surfaces).open, shade_by_map(env, surfaces).open),
              0.02);
  }
}

TEST(RealMaps, HaveTheParksSunAtItsPixel) {
  const auto path = real_data() / "env" / "park.hdr";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no real data at " << path;
  const Environment env = environment_from_map(capture::read_rgbe(path), 0, 256);
  const Vec3f sun = direction_of_texel(614, 226, 1024, 512);
  EXPECT_GE(dot(brightest(make_light_table(env, {})).direction, sun), std::cos(0.5 * degree));
  const Environment turned = environment_from_map(capture::read_rgbe(path), 0.5, 256);
  const Vec3f d = brightest(make_light_table(turned, {})).direction;
  EXPECT_NEAR(std::atan2(d.y, d.x) - std::atan2(sun.y, sun.x), 0.5, 0.01);
}

TEST(RealBracket, HasItsWindowsWhereTheyWereMeasured) {
  const auto directory = real_data() / "brackets" / "fisheye8mm";
  if (!std::filesystem::exists(directory)) GTEST_SKIP() << "no real data at " << directory;
  std::vector<std::string> shots;
  for (int number = 6955; number <= 6971; number += 2) {
    shots.push_back(directory / ("IMG_" + std::to_string(number) + ".JPG"));
  }
  const capture::HdrResult hdr =
      capture::make_hdr(shots, {{}, directory / "Response_function.rsp"});
  const calibrate::Lens lens{"equisolid", 2808, 1872, {622.4, 1412.5, 932.0}, 93 * degree};
  const calibrate::Mat3 set_from_cam{
      {.9990, .0453, -.0002, 0, .0042, 1.0000, .0453, -.9990, .0042}};
  const calibrate::Pose probe_from_set =
      calibrate::pose_from_rotation(set_from_cam.transposed(), {0, 0, .36});
  ProbeMapper mapper(lens, probe_from_set,
                     {.height = 256, .unseen = Unseen::mean, .vignetting = {.0802, -.1180, .0140}});
  Environment env;
  mapper.map(hdr.radiance, {}, env);
  // The bright windows: azimuth clockwise from the axis (+y), elevation, solid angle.
  calibrate::Vec3 windows;
  double total = 0;
  for (int y = 0; y < 128; ++y) {
    for (int x = 0; x < 512; ++x) {
      if (env.seen[static_cast<std::size_t>(y * 512 + x)] == 0) continue;
      const Vec3f d = direction_of_texel(static_cast<float>(x), static_cast<float>(y), 512, 256);
      const double light = env.radiance.at(y, x, 1) * texel_solid_angle(y, 512, 256);
      windows += to_double(d) * (light * light);
      total += light * d.z;
    }
  }
  const calibrate::Vec3 d = normalize(windows);
  EXPECT_NEAR(std::atan2(d.x, d.y) / degree, 69, 6);
  EXPECT_NEAR(std::asin(d.z) / degree, 15.5, 5);
  EXPECT_NEAR(mapper.seen_part(), 0.52, 0.02);
  const LightTable table = make_light_table(env, {});
  const Vec3f main_light = brightest(table).direction;
  EXPECT_NEAR(std::atan2(main_light.x, main_light.y) / degree, 69, 15);
  EXPECT_GT(total, 0);
}

}  // namespace
}  // namespace render::real_light_test
