// What is narrower than the pixels that are looked at first: shadows beside the things that cast
// them, wherever in a cell, and tips of bright things that no pixel's centre shows.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "made_shot.h"
#include "render/kept_transport.h"

namespace compositing::narrow_things_test {
namespace {

using capture::float_from_half;

constexpr int side = 64;
constexpr double middle = 31.5;
constexpr double metres_a_pixel = 0.01;

// Of the picture, where a column or a row is in the set.
float metres_right(double column) { return static_cast<float>((column - middle) * metres_a_pixel); }
float metres_up(double row) { return static_cast<float>((middle - row) * metres_a_pixel); }

MadeShot from_above(render::SceneDescription scene) {
  MadeShot shot = made_shot(side, side, std::move(scene));
  shot.directions =
      calibrate::make_direction_table({"pinhole", side, side, {1000, 1000, middle, middle}});
  shot.job.cam_from_set = calibrate::look_at({0, 0, 10}, {0, 0, 0}, 0);
  return shot;
}

render::FrameResult frame_of(const MadeShot& shot) {
  render::FrameResult result;
  render_frame(shot.inputs(), shot.job, shot.plate, result);
  return result;
}

// A slab on the floor, half a pixel high, that covers all of the picture from behind row `row` on.
MadeShot beside_slab(int row) {
  render::SceneDescription scene = shot_scene(false);
  auto slab = std::make_shared<render::Mesh>();
  const float edge = metres_up(row + 0.5), height = 0.005F;
  slab->positions = {{-5, -5, height},   {5, -5, height}, {5, edge, height},
                     {-5, edge, height}, {5, edge, 0},    {-5, edge, 0}};
  slab->triangles = {{0, 1, 2}, {0, 2, 3}, {3, 2, 4}, {3, 4, 5}};
  slab->materials = {1};
  scene.meshes.push_back(std::move(slab));
  scene.instances.emplace_back().mesh = 1;
  return from_above(std::move(scene));
}

// Of the picture's rows, the root mean square of what the shadow is off in the one beside the slab.
double shadow_error(const render::FrameResult& frame, const render::FrameResult& truth, int row) {
  double squares = 0;
  for (int x = 0; x < side; ++x) {
    const std::size_t i = frame.matte.index(row, x);
    squares += std::pow(static_cast<double>(float_from_half(frame.matte.pixels[i]) -
                                            float_from_half(truth.matte.pixels[i])),
                        2);
  }
  return std::sqrt(squares / side);
}

// One pixel of 4x4 is asked first. The shadow's only row is the border of such a block for one edge
// of four, and of a cell for one of sixteen.
TEST(NarrowShadows, AreFoundBesideWhatCastsThemWhereverABlockEnds) {
  for (const bool soft : {false, true}) {
    for (int row = 18; row < 34; ++row) {
      MadeShot shot = beside_slab(row);
      shot.job.effort.soft_lights = soft;
      shot.job.effort.adaptive_visibility = false;
      const render::FrameResult truth = frame_of(shot);
      shot.job.effort.adaptive_visibility = true;
      EXPECT_LT(shadow_error(frame_of(shot), truth, row), 0.01) << row << (soft ? " soft" : "");
      double shadow = 0;
      for (int x = 0; x < side; ++x) {
        shadow +=
            static_cast<double>(float_from_half(truth.matte.pixels[truth.matte.index(row, x)])) /
            side;
      }
      EXPECT_GT(shadow, 0.1) << "there is one";
    }
  }
}

// A glowing square whose corner ends a part of a pixel beyond that pixel's own corner.
TEST(NarrowTips, AreSeenWhereNoPixelsSideShowsThem) {
  constexpr float glow = 20;
  for (const auto& [across, down] :
       {std::array<double, 2>{0.3, 0.3}, {0.4, 0.2}, {0.15, 0.45}, {0.45, 0.45}}) {
    for (const int at : {20, 22, 25}) {
      render::SceneDescription scene = shot_scene(false);
      render::StandardParameters bright;
      std::fill_n(bright.base_color, 3, 0.0F);
      bright.specular = 0;
      std::fill_n(bright.emission, 3, glow);
      scene.materials.push_back(make_standard_material("glow", bright));
      auto square = std::make_shared<render::Mesh>();
      const float left = metres_right(at - 10), right = metres_right(at + 0.5 + across);
      const float top = metres_up(at - 10), bottom = metres_up(at + 0.5 + down);
      const float height = 1e-4F;
      square->positions = {{left, bottom, height},
                           {right, bottom, height},
                           {right, top, height},
                           {left, top, height}};
      square->triangles = {{0, 1, 2}, {0, 2, 3}};
      square->materials = {static_cast<std::uint32_t>(scene.materials.size() - 1)};
      scene.meshes.push_back(std::move(square));
      scene.instances.emplace_back().mesh = 1;
      const render::FrameResult frame = frame_of(from_above(std::move(scene)));
      const std::size_t tip = frame.rgba.index(at + 1, at + 1);
      const double shown = static_cast<double>(float_from_half(frame.rgba.pixels[tip]));
      EXPECT_NEAR(shown / double{glow}, across * down, 0.04) << at << ' ' << across << ' ' << down;
    }
  }
}

// A dim sun, or a lamp as far away, or many that are bright together, from the right: a roof of
// which nothing is in the picture casts a shadow that ends aslant across its columns, a twentieth
// of a pixel further from row to row.
enum class Source { sun, lamp, many_lamps };

MadeShot under_a_roof(Source source, float roughness) {
  render::SceneDescription scene = shot_scene(false);
  scene.instances.clear(), scene.meshes.clear();
  render::StandardParameters grey;
  std::fill_n(grey.base_color, 3, 0.5F);
  grey.roughness = roughness;
  grey.specular = roughness < 1 ? 1 : 0;
  scene.materials.push_back(make_standard_material("grey", grey));
  scene.meshes.push_back(made_floor(20, static_cast<std::uint32_t>(scene.materials.size() - 1)));
  scene.instances.emplace_back().name = "floor";
  auto roof = std::make_shared<render::Mesh>();
  roof->positions = {{0.75F, -5, 1}, {5, -5, 1}, {5, 5, 1}, {1.25F, 5, 1}};
  roof->triangles = {{0, 1, 2}, {0, 2, 3}};
  roof->materials = {static_cast<std::uint32_t>(scene.materials.size() - 1)};
  scene.meshes.push_back(std::move(roof));
  scene.instances.emplace_back().mesh = 1;
  MadeShot shot = from_above(std::move(scene));
  shot.environment.compact_apart = true;  // so that the sun is mirrored as a light
  const float half = std::sqrt(0.5F), far_m = 1000;
  shot.job.lights.lights = {{{0, 0, 1}, {0.3F, 0.3F, 0.3F}, 0}};
  if (source == Source::sun) {
    shot.job.lights.lights.push_back({{half, 0, half}, {0.4F, 0.4F, 0.4F}, 0, 1});
  } else {
    const int count = source == Source::lamp ? 1 : 64;
    const float intensity = (count > 1 ? 2 : 0.4F) / static_cast<float>(count) * far_m * far_m;
    for (int i = 0; i < count; ++i) {
      shot.job.lights.lamps.push_back(
          {{half * far_m, 0, half * far_m}, {}, {intensity, intensity, intensity}});
    }
  }
  return shot;
}

TEST(SharpShadows, EndWithinPixelsAlsoWhereTheyAreFaint) {
  for (const Source source : {Source::sun, Source::lamp, Source::many_lamps}) {
    for (const float roughness : {1.0F, 0.5F}) {
      const render::FrameResult frame = frame_of(under_a_roof(source, roughness));
      double squares = 0, by_halves = 0, largest_step = 0;
      int pixels = 0;
      for (int row = 0; row < side; ++row) {
        const auto at = [&](int column) {
          return static_cast<double>(
              float_from_half(frame.rgba.pixels[frame.rgba.index(row, column)]));
        };
        const double end_m = 0.05 * double{metres_up(row)};  // the roof's edge, less its height
        const double end = middle + end_m / metres_a_pixel + 0.5;
        for (int x = 2; x < side - 2; ++x) {
          const double lit = std::clamp(end - x, 0.0, 1.0);
          if (lit <= 0 || lit >= 1) continue;
          if (x % 16 == 0 || x % 16 == 15) continue;  // between cells it is not found
          const double bright = at(x - 2), dark = at(x + 2);
          const double off = (at(x) - dark) / (bright - dark) - lit;
          squares += off * off;
          by_halves += std::pow((lit > 0.5 ? 1 : 0) - lit, 2);
          largest_step = std::max(largest_step, bright - dark);
          ++pixels;
        }
      }
      EXPECT_GT(pixels, side / 4);
      EXPECT_GT(largest_step, 0.03);
      if (source != Source::many_lamps) {
        EXPECT_LT(largest_step, 0.1) << "less than the effort looks for in broad light";
      }
      EXPECT_LT(std::sqrt(squares), 0.3 * std::sqrt(by_halves))
          << static_cast<int>(source) << roughness;
    }
  }
}

// A sheet of bare metal in the sun, whose end is rounded within less than half a pixel.
MadeShot of_a_sheet(double column, double zoom, float roughness) {
  render::SceneDescription scene = shot_scene(false);
  render::StandardParameters metal;
  metal.metallic = 1;
  metal.roughness = roughness;
  scene.materials.push_back(make_standard_material("metal", metal));
  auto sheet = std::make_shared<render::Mesh>();
  constexpr int around = 32;
  constexpr float radius = 0.004F;
  const auto add = [&](float x, float z, render::Vec3f normal) {
    for (const float y : {-5.0F, 5.0F}) {
      sheet->positions.push_back({x, y, z});
      sheet->normals.push_back(normal);
    }
  };
  const float end = metres_right(column) - radius, height = 0.1F;
  for (int i = 0; i <= around; ++i) {
    const float angle = std::numbers::pi_v<float> / 2 * static_cast<float>(i) / around;
    const render::Vec3f out{std::cos(angle), 0, std::sin(angle)};
    add(end + radius * out.x, height + radius * out.z, out);
  }
  add(-5, height + radius, {0, 0, 1});
  for (std::uint32_t i = 0; i <= around; ++i) {
    sheet->triangles.push_back({2 * i, 2 * i + 2, 2 * i + 1});
    sheet->triangles.push_back({2 * i + 1, 2 * i + 2, 2 * i + 3});
  }
  sheet->materials = {static_cast<std::uint32_t>(scene.materials.size() - 1)};
  scene.meshes.push_back(std::move(sheet));
  scene.instances.emplace_back().mesh = 1;
  MadeShot shot = from_above(std::move(scene));
  shot.directions = calibrate::make_direction_table(
      {"pinhole", side, side, {1000 * zoom, 1000 * zoom, middle, middle}});
  shot.environment = made_sky(32, 0, 0);
  shot.environment.compact_apart = true;
  shot.job.lights.lights = {{{0.6F, 0, 0.8F}, {3, 3, 3}, 0.005F, 1}};
  std::ranges::fill(shot.plate.pixels, capture::Half{0});
  return shot;
}

double mean_of_middle(const render::FrameResult& frame, int size) {
  double sum = 0;
  for (int y = (side - size) / 2; y < (side + size) / 2; ++y) {
    for (int x = (side - size) / 2; x < (side + size) / 2; ++x) {
      sum += static_cast<double>(float_from_half(frame.rgba.pixels[frame.rgba.index(y, x)]));
    }
  }
  return sum / (size * size);
}

TEST(BentEdges, GlintAsBrightFromFarAsFromNear) {
  constexpr int zoom = 8;
  for (const float roughness : {0.15F, 0.3F, 0.5F}) {
    double far = 0, near = 0;
    for (const double column : {31.0, 31.2, 31.4, 31.6, 31.8}) {
      far += mean_of_middle(frame_of(of_a_sheet(column, 1, roughness)), side / zoom);
      near += mean_of_middle(frame_of(of_a_sheet(column, zoom, roughness)), side);
    }
    EXPECT_GT(near, 0.1);
    EXPECT_NEAR(far / near, 1, 0.06) << roughness;
  }
}

// Lights two fifths of a pixel wide on a black floor, one for each cell but the outer ones, each
// elsewhere among the pixels' centres.
constexpr double light_side = 0.4;
constexpr float light_radiance = 2;
render::SceneDescription small_lights(double aside) {
  register_shaders();
  render::SceneDescription scene;
  scene.background = "environment";
  render::StandardParameters black;
  std::fill_n(black.base_color, 3, 0.0F);
  black.specular = 0;
  scene.materials = {make_standard_material("floor", black)};
  std::fill_n(black.emission, 3, light_radiance);
  scene.materials.push_back(make_standard_material("lights", black));
  auto floor = made_floor(20, 0);
  auto lights = std::make_shared<render::Mesh>();
  for (int i = 0; i < 16; ++i) {
    const double column = 8 + 16 * (i % 4) + 0.37 * i + aside, row = 8 + 16 * (i / 4) + 0.23 * i;
    const auto first = static_cast<std::uint32_t>(lights->positions.size());
    for (const auto& [x, y] : {std::pair{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}}) {
      lights->positions.push_back(
          {metres_right(column + x * light_side), metres_up(row + y * light_side), 1e-3F});
    }
    lights->triangles.push_back({first, first + 1, first + 2});
    lights->triangles.push_back({first, first + 2, first + 3});
  }
  lights->materials = {1};
  scene.meshes = {std::move(floor), std::move(lights)};
  scene.instances.resize(2);
  scene.instances[1].mesh = 1;
  return scene;
}

TEST(SmallLights, AreSeenWhereNoPixelsCentreShowsThem) {
  double shown = 0;
  constexpr int places = 8;
  for (int i = 0; i < places; ++i) {
    MadeShot shot = from_above(small_lights(i / double{places}));
    shot.environment = made_sky(32, 0, 0);
    const render::FrameResult frame = frame_of(shot);
    EXPECT_LT(frame.statistics.primary_rays, side * side + 16 * 9 * 100U) << "only about them";
    for (int cell = 0; cell < 16; ++cell) {
      double sum = 0;
      for (int p = 0; p < 256; ++p) {
        const int y = cell / 4 * 16 + p / 16, x = cell % 4 * 16 + p % 16;
        sum += double{float_from_half(frame.rgba.pixels[frame.rgba.index(y, x)])};
      }
      EXPECT_GT(sum, 0.3 * light_side * light_side * double{light_radiance}) << i << " " << cell;
      shown += sum / (16 * places);
    }
  }
  EXPECT_NEAR(shown / (light_side * light_side * double{light_radiance}), 1, 0.05);
}

TEST(SmallLights, AreFoundAnewWhereTheyMove) {
  render::KeptTransport kept;
  std::unique_ptr<render::Scene> before;
  for (int i = 0; i < 6; ++i) {
    render::SceneDescription scene = small_lights(0.3);
    scene.instances[1].moves = true;
    scene.instances[1].set_from_object[3] = metres_right(middle + 0.7 * i);
    scene.instances[1].set_from_object[7] = metres_up(middle + 0.3 * i);
    const MadeShot cold = from_above(scene);
    // The same scene's meshes: only then it goes on from the one before.
    if (before) scene.meshes = before->description().meshes;
    auto now = before ? std::make_unique<render::Scene>(std::move(scene), *before)
                      : std::make_unique<render::Scene>(std::move(scene));
    render::FrameInputs inputs = cold.inputs();
    inputs.scene = now.get();
    inputs.kept = &kept;
    render::FrameResult warm;
    render_frame(inputs, cold.job, cold.plate, warm);
    EXPECT_EQ(warm.rgba.pixels, frame_of(cold).rgba.pixels) << i;
    before = std::move(now);
  }
}

}  // namespace
}  // namespace compositing::narrow_things_test
