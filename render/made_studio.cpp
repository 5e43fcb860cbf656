// The made studio: cameras placed, light moved, pictures taken.
#include "render/made_studio.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <utility>

#include "calibrate/angles.h"
#include "render/environment.h"
#include "render/made_lamp.h"
#include "render/photograph_view.h"
#include "render/reference.h"
#include "render/standard.h"

namespace render {
namespace {

using calibrate::degree;
constexpr capture::Rational plate_rate{25, 1};

// A cloud's shadow takes at most this share of the sun's light.
constexpr double cloud_share = 0.35;

MadeCamera make_plate_camera(const MadeStudioSettings& settings) {
  MadeCamera camera;
  const double scale = settings.width / 640.0;
  camera.lens.model = "LENSMODEL_OPENCV4";
  camera.lens.width = settings.width;
  camera.lens.height = settings.height;
  camera.lens.parameters = {548.3 * scale,
                            549.1 * scale,
                            (settings.width - 1) / 2.0 + 3.7 * scale,
                            (settings.height - 1) / 2.0 - 2.9 * scale,
                            -0.148,
                            0.046,
                            0.0006,
                            -0.0004};
  camera.cam_from_set = calibrate::look_at({-2.4, -3.36, 2.0}, {0.15, 0.12, 0.4}, 0.4 * degree);
  constexpr double exposure_s = 1.0 / 250;
  camera.sensor = {.saturation = exposure_s,  // display white fills the well
                   .full_well_e = 15000,
                   .read_noise_e = 6,
                   .bits = 8,
                   .transfer = capture::Transfer::rec1886,
                   .seed = settings.seed * 2 + 1};
  camera.exposures_s = {exposure_s};
  camera.rate = plate_rate;
  return camera;
}

Environment as_environment(const capture::Image& radiance) {
  Environment environment;
  environment.radiance = radiance;
  environment.seen.assign(
      static_cast<std::size_t>(radiance.width) * static_cast<std::size_t>(radiance.height), 1);
  return environment;
}

// Brighter than anything but the sun.
constexpr float sun_radiance = 100;
// A seen sun fills few pixels, whose light is most of the picture's: they take so many paths more.
constexpr int sun_samples_factor = 64;
constexpr int sun_margin_px = 6;

struct PixelRect {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // x1 and y1 are beyond it
};

// Where the sun is seen, with a margin; nothing if it is not.
std::optional<PixelRect> find_sun(const capture::Image& picture) {
  PixelRect rect{picture.width, picture.height, 0, 0};
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      if (picture.at(y, x, 1) < sun_radiance) continue;
      rect.x0 = std::min(rect.x0, x);
      rect.y0 = std::min(rect.y0, y);
      rect.x1 = std::max(rect.x1, x + 1);
      rect.y1 = std::max(rect.y1, y + 1);
    }
  }
  if (rect.x1 == 0) return std::nullopt;
  return PixelRect{std::max(rect.x0 - sun_margin_px, 0), std::max(rect.y0 - sun_margin_px, 0),
                   std::min(rect.x1 + sun_margin_px, picture.width),
                   std::min(rect.y1 + sun_margin_px, picture.height)};
}

calibrate::DirectionTable cut_out(const calibrate::DirectionTable& whole, const PixelRect& rect) {
  calibrate::DirectionTable part;
  part.width = rect.x1 - rect.x0;
  part.height = rect.y1 - rect.y0;
  for (int y = -1; y <= part.height; ++y) {
    for (int x = -1; x <= part.width; ++x) {
      const std::size_t i = whole.index(rect.y0 + y, rect.x0 + x);
      part.x.push_back(whole.x[i]);
      part.y.push_back(whole.y[i]);
      part.z.push_back(whole.z[i]);
    }
  }
  return part;
}

// The same scene where only that glows whose material `glows`; null if that is so anyway.
template <class Glows>
std::unique_ptr<Scene> with_glow(const Scene& scene, const Glows& glows) {
  SceneDescription description = scene.description();
  bool changed = false;
  for (Material& material : description.materials) {
    StandardParameters parameters =
        standard_parameters(material, description.textures.size(), description.videos.size());
    const bool dark = std::ranges::all_of(parameters.emission, [](float e) { return e == 0; });
    if (dark || glows(material.name)) continue;
    changed = true;
    std::ranges::fill(parameters.emission, 0.0F);
    material = make_standard_material(material.name, parameters);
  }
  return changed ? std::make_unique<Scene>(std::move(description)) : nullptr;
}

}  // namespace

capture::Time time_of_picture(const MadeCamera& camera, std::int64_t n) {
  return camera.start + capture::time_of_frame(n, camera.rate);
}

double exposure_of_picture(const MadeCamera& camera, std::int64_t n) {
  const auto count = static_cast<std::int64_t>(camera.exposures_s.size());
  return camera.exposures_s[static_cast<std::size_t>(((n % count) + count) % count)];
}

calibrate::Pose pose_of_picture(const MadeCamera& camera, std::int64_t n) {
  if (camera.track.keys.empty()) return camera.cam_from_set;
  const capture::Time since = time_of_picture(camera, n) - camera.start;
  return pose_at(camera.track, std::chrono::duration<double>(since).count()).cam_from_set;
}

MadeCamera make_fisheye(int size, std::vector<double> exposures_s, std::uint32_t seed) {
  MadeCamera camera;
  constexpr double max_angle = 93 * degree;
  const double centre = (size - 1) / 2.0;
  camera.lens.model = "equisolid";
  camera.lens.width = size;
  camera.lens.height = size;
  camera.lens.parameters = {(centre - 0.5) / (2 * std::sin(max_angle / 2)), centre, centre};
  camera.lens.max_angle_rad = max_angle;
  camera.cam_from_set = calibrate::pose_from_axis({0, 0, 0.45}, {0, 0, 1}, 0);
  camera.exposures_s = std::move(exposures_s);
  camera.sensor = {.saturation = 10.0 / 100,
                   .full_well_e = 15000,
                   .read_noise_e = 6,
                   .bits = 8,
                   .transfer = capture::Transfer::srgb,
                   .seed = seed};
  const auto shots = static_cast<std::int64_t>(camera.exposures_s.size());
  camera.rate = {plate_rate.num * shots, plate_rate.den};
  // A whole bracket is there when the plate begins.
  camera.start = -capture::time_of_frame(shots - 1, camera.rate);
  return camera;
}

void check(const MadeStudioSettings& settings) {
  if (std::min({settings.width, settings.height, settings.probe_size, settings.texture_size}) <
      16) {
    throw std::invalid_argument("a made studio's pictures are at least 16 pixels wide and high");
  }
  if (settings.frames < 1) throw std::invalid_argument("a made studio needs at least one frame");
}

MadeStudio make_studio(const MadeStudioSettings& settings) {
  check(settings);
  MadeStudio studio;
  studio.settings = settings;
  studio.sky = make_sky({.height = settings.sky_height,
                         .sun_azimuth_rad = static_cast<float>(172 * degree),
                         .sun_elevation_rad = static_cast<float>(38 * degree),
                         .seed = settings.seed});
  studio.place = make_court({.texture_size = settings.texture_size, .seed = settings.seed});
  studio.car_yaw_deg = court_car_yaw_deg;
  studio.cloud_share = cloud_share;
  studio.plate = make_plate_camera(settings);
  // The longest exposure shows trees well, the shortest does not clip the sun.
  studio.probe = make_fisheye(settings.probe_size, {1.0 / 100, 1.0 / 2500, 1.0 / 100000},
                              settings.seed * 2 + 2);
  studio.period = capture::time_of_frame(settings.frames, plate_rate);
  return studio;
}

float sun_strength(const MadeStudio& studio, capture::Time time) {
  const double turn =
      std::chrono::duration<double>(time) / std::chrono::duration<double>(studio.period);
  return static_cast<float>(1 - studio.cloud_share *
                                    (0.5 - 0.5 * std::cos(2 * std::numbers::pi * turn)));
}

std::array<int, 4> picture_of_card(const MadeStudio& studio) {
  // The largest rectangle of the plate's shape about the middle whose corners lie in the card.
  const MadeCard& card = court_card;
  const auto place = [&](double along, double across) {
    const double c = std::cos(card.yaw_rad);
    const double s = std::sin(card.yaw_rad);
    const calibrate::Vec3 p_set =
        to_double(card.middle) + calibrate::Vec3{c * along - s * across, s * along + c * across, 0};
    const auto q = project(studio.plate.lens, studio.plate.cam_from_set * p_set);
    if (!q) throw std::logic_error("the plate camera must see the grey card");
    return *q;
  };
  const calibrate::Vec2 middle = place(0, 0);
  std::array<calibrate::Vec2, 4> corners{
      place(-0.5 * card.width, -0.5 * card.depth), place(0.5 * card.width, -0.5 * card.depth),
      place(0.5 * card.width, 0.5 * card.depth), place(-0.5 * card.width, 0.5 * card.depth)};
  const auto inside = [&](double x, double y) {
    int turns = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const calibrate::Vec2 a = corners[i];
      const calibrate::Vec2 b = corners[(i + 1) % 4];
      turns += (b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x) > 0 ? 1 : -1;
    }
    return turns == 4 || turns == -4;
  };
  constexpr double margin = 1.5;  // pixels that blur with what lies beside
  double half = 0;
  const auto fits = [&](double h) {
    const double w = 1.4 * h;
    return inside(middle.x - w - margin, middle.y - h - margin) &&
           inside(middle.x + w + margin, middle.y - h - margin) &&
           inside(middle.x - w - margin, middle.y + h + margin) &&
           inside(middle.x + w + margin, middle.y + h + margin);
  };
  while (fits(half + 0.25)) half += 0.25;
  const int x = static_cast<int>(std::ceil(middle.x - 1.4 * half));
  const int y = static_cast<int>(std::ceil(middle.y - half));
  return {x, y, std::max(1, static_cast<int>(std::floor(middle.x + 1.4 * half)) - x + 1),
          std::max(1, static_cast<int>(std::floor(middle.y + half)) - y + 1)};
}

capture::Image add_light(const LightParts& parts, float sun_strength) {
  capture::Image sum = parts.rest;
  for (std::size_t i = 0; i < sum.pixels.size(); ++i) {
    sum.pixels[i] += sun_strength * parts.sun.pixels[i];
    if (!parts.lamps.empty()) sum.pixels[i] += parts.lamps.pixels[i];
  }
  return sum;
}

LightParts photograph_parts(const MadeStudio& studio,
                            const Scene& scene,
                            const calibrate::DirectionTable& directions,
                            const calibrate::Pose& cam_from_set,
                            const PhotographSettings& settings) {
  ReferenceSettings paths{.samples = settings.samples, .seed = settings.seed, .bounces = true};
  PhotographView view{.behind_virtual = settings.behind_virtual};
  const auto take = [&](const std::unique_ptr<Scene>& other, const capture::Image& light,
                        const calibrate::DirectionTable& towards) {
    const Environment environment = as_environment(light);
    return photograph({other ? other.get() : &scene, &towards, &environment}, cam_from_set, paths,
                      view);
  };
  // What glows by itself is there once, whatever the sun does: in the rest, or, where lamps stand
  // for it, in a part of its own.
  const auto is_lamp = [&](const std::string& name) {
    return !settings.lamps.empty() && name == lamp_glow;
  };
  const auto sunlit = with_glow(scene, [](const std::string&) { return false; });
  const auto restlit = with_glow(scene, [&](const std::string& name) { return !is_lamp(name); });
  LightParts parts{
      take(sunlit, studio.sky.sun, directions), take(restlit, studio.sky.rest, directions), {}};
  if (!settings.lamps.empty()) {
    view.lamps = settings.lamps;
    parts.lamps = take(with_glow(scene, is_lamp), capture::make_image(16, 32), directions);
    view.lamps = {};
  }
  if (const auto rect = find_sun(parts.sun)) {
    paths.samples = settings.samples * sun_samples_factor;
    const capture::Image finer = take(sunlit, studio.sky.sun, cut_out(directions, *rect));
    for (int y = 0; y < finer.height; ++y) {
      std::copy_n(&finer.pixels[finer.index(y, 0)], finer.width * 3,
                  &parts.sun.pixels[parts.sun.index(rect->y0 + y, rect->x0)]);
    }
  }
  return parts;
}

calibrate::DirectionTable latlong_directions(int height) {
  calibrate::DirectionTable table;
  table.width = 2 * height;
  table.height = height;
  const std::size_t entries =
      static_cast<std::size_t>(height + 2) * static_cast<std::size_t>(table.width + 2);
  table.x.resize(entries);
  table.y.resize(entries);
  table.z.resize(entries);
  for (int y = -1; y <= height; ++y) {
    for (int x = -1; x <= table.width; ++x) {
      const Vec3f v =
          direction_of_texel(static_cast<float>(x), static_cast<float>(y), table.width, height);
      const std::size_t i = table.index(y, x);
      table.x[i] = v.x;
      table.y[i] = v.y;
      table.z[i] = v.z;
    }
  }
  return table;
}

capture::Image coverage_of(const SceneDescription& scene,
                           const std::vector<bool>& seen,
                           const calibrate::DirectionTable& directions,
                           const calibrate::Pose& cam_from_set,
                           int samples) {
  if (seen.size() != scene.instances.size()) {
    throw std::invalid_argument("coverage needs one flag for each instance");
  }
  // The same shapes, black; what is asked for glows. No light but that: what is seen is coverage.
  SceneDescription glowing = scene;
  StandardParameters parameters;
  std::ranges::fill(parameters.base_color, 0.0F);
  glowing.materials = {make_standard_material("black", parameters)};
  std::ranges::fill(parameters.emission, 1.0F);
  glowing.materials.push_back(make_standard_material("glowing", parameters));
  glowing.meshes.clear();
  for (std::size_t i = 0; i < glowing.instances.size(); ++i) {
    Mesh mesh = *scene.meshes[glowing.instances[i].mesh];
    mesh.materials = {seen[i] ? 1U : 0U};
    glowing.instances[i].mesh = static_cast<std::uint32_t>(glowing.meshes.size());
    glowing.meshes.push_back(std::make_shared<const Mesh>(std::move(mesh)));
  }
  const Scene compiled(std::move(glowing));
  const Environment dark = as_environment(capture::make_image(16, 32));
  ReferenceSettings settings{.samples = samples, .max_depth = 1, .bounces = false};
  const capture::Image picture =
      photograph({&compiled, &directions, &dark}, cam_from_set, settings);
  capture::Image coverage = capture::make_image(picture.height, picture.width, 1);
  for (std::size_t i = 0; i < coverage.pixels.size(); ++i) {
    coverage.pixels[i] = std::min(picture.pixels[3 * i + 1], 1.0F);
  }
  return coverage;
}

}  // namespace render
