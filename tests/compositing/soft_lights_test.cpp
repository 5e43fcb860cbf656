// Lights that stand for regions of the sky, looked for all over them: soft shadows against the area
// of a disc that an edge leaves, sharp ones where things touch, and how few lights they need.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <set>

#include "compositing/billboard.h"
#include "compositing/keyed_picture.h"
#include "made_shot.h"
#include "render/cell_visibility.h"
#include "render/soft_lights.h"
#include "render/texture.h"
#include "render/visibility_finder.h"

namespace compositing::soft_lights_test {
namespace {

using capture::float_from_half;
using render::SoftLights;
using render::Vec3f;

using std::numbers::pi;

constexpr int side = 64;
constexpr double metres_a_pixel = 0.01;

// A floor seen from straight above, under one light, and a board `height` above it that covers what
// is below row `row` of the picture.
MadeShot under_board(double row, float height, const render::DirectionalLight& light) {
  render::SceneDescription scene = shot_scene(false);
  auto board = std::make_shared<render::Mesh>();
  const auto edge = static_cast<float>((31.5 - row) * metres_a_pixel);
  board->positions = {{-5, -5, height}, {5, -5, height}, {5, edge, height}, {-5, edge, height}};
  board->triangles = {{0, 1, 2}, {0, 2, 3}};
  board->materials = {1};
  scene.meshes.push_back(std::move(board));
  scene.instances.emplace_back().mesh = 1;
  MadeShot shot = made_shot(side, side, std::move(scene));
  shot.directions =
      calibrate::make_direction_table({"pinhole", side, side, {1000, 1000, 31.5, 31.5}});
  shot.job.cam_from_set = calibrate::look_at({0, 0, 10}, {0, 0, 0}, 0);
  shot.job.lights.lights = {light};
  return shot;
}

render::FrameResult frame_of(const MadeShot& shot) {
  render::FrameResult result;
  render_frame(shot.inputs(), shot.job, shot.plate, result);
  return result;
}

double matte_at(const render::FrameResult& frame, int x, int y) {
  return static_cast<double>(float_from_half(frame.matte.pixels[frame.matte.index(y, x)]));
}

// Of a disc of radius 1, the area beyond a straight line at `offset` from its middle, as a share.
double disc_beyond(double offset) {
  const double x = std::clamp(offset, -1.0, 1.0);
  return (std::acos(x) - x * std::sqrt(1 - x * x)) / pi;
}

TEST(SoftLights, LookAllOverTheirRegions) {
  const std::array<render::DirectionalLight, 4> lights{{{{0, 0, 1}, {1, 1, 1}, 0.2F},
                                                        {{1, 0, 0}, {1, 1, 1}, 0.02F},
                                                        {{0.6F, 0, 0.8F}, {9, 9, 9}, 0.01F, 1},
                                                        {{0, 1, 0}, {1, 1, 1}, 0}}};
  render::LightTable table;
  table.lights.assign(lights.begin(), lights.end());
  const SoftLights soft(table);
  EXPECT_FALSE(soft.has(2)) << "a compact light has no parts";
  EXPECT_FALSE(soft.has(3)) << "nor has one that is no region";
  EXPECT_FALSE(soft.has(4));
  for (std::size_t i = 0; i < 2; ++i) {
    ASSERT_TRUE(soft.has(i));
    const render::DirectionRange range = soft.range(i);
    Vec3f sum{};
    double squares = 0;
    for (std::uint8_t part = 0; part < SoftLights::count; ++part) {
      const Vec3f to = soft.direction(i, part);
      EXPECT_NEAR(length(to), 1, 1e-5);
      const double angle = std::acos(std::min(1.0F, dot(to, lights[i].direction)));
      EXPECT_LE(angle, lights[i].spread * 1.001);
      squares += angle * angle;
      sum += to;
      EXPECT_TRUE(range.lower.x <= to.x && to.x <= range.upper.x);
      EXPECT_TRUE(range.lower.y <= to.y && to.y <= range.upper.y);
      EXPECT_TRUE(range.lower.z <= to.z && to.z <= range.upper.z);
    }
    EXPECT_NEAR(length(normalize(sum) - lights[i].direction), 0, 1e-3) << "about its middle";
    // A disc's points lie half its squared radius from the middle, in the mean of their squares.
    EXPECT_NEAR(squares / SoftLights::count / (lights[i].spread * lights[i].spread), 0.5, 0.05);
  }
  for (std::size_t y = 0; y < 5; ++y) {
    for (std::size_t x = 0; x < 5; ++x) {
      std::set<int> parts;
      std::array<double, 4> along{};  // of both places in the region, with both of the pixels
      for (std::size_t k = 0; k < 16; ++k) {
        const int part = SoftLights::part_of_pixel(x + k % 4, y + k / 4);
        parts.insert(part);
        const double column = static_cast<double>(k % 4) - 1.5;
        const double row = static_cast<double>(k / 4) - 1.5;
        along[0] += column * (part % 4), along[1] += column * (part / 4);
        along[2] += row * (part % 4), along[3] += row * (part / 4);
      }
      EXPECT_EQ(parts.size(), SoftLights::count) << "of any 4x4 pixels";
      for (const double sum : along) EXPECT_EQ(sum, 0) << "parts go with no side of the pixels";
    }
  }
  std::set<int> parts, quarters;
  for (std::uint32_t sample = 0; sample < 16; ++sample) {
    const int part = SoftLights::part_of_sample(sample);
    parts.insert(part);
    if (sample < 4) quarters.insert(part % 4 / 2 + part / 8 * 2);
  }
  EXPECT_EQ(parts.size(), 16U);
  EXPECT_EQ(quarters.size(), 4U) << "the first four samples look into different quarters";
}

TEST(SoftLights, AreSeenInAllQuartersByFourBlocksOfWhichOnePixelEachIsAsked) {
  for (std::uint32_t light = 0; light < 4; ++light) {
    for (std::uint32_t first = 0; first < 4; ++first) {  // the blocks' row and column
      std::set<int> quarters, columns;
      int rows = 0;
      for (std::uint32_t block = 0; block < 4; ++block) {
        const std::uint32_t column = first % 2 + block % 2, row = first / 2 + block / 2;
        const auto [x, y] = render::pixel_of_quad(light, row % 2);
        const int part = SoftLights::part_of_pixel(2 * column + static_cast<std::uint32_t>(x),
                                                   2 * row + static_cast<std::uint32_t>(y));
        quarters.insert(part % 4 / 2 + part / 8 * 2);
        columns.insert(part % 4);
        rows += part / 4;
      }
      EXPECT_EQ(quarters.size(), 4U);
      EXPECT_EQ(columns.size(), 4U);
      EXPECT_EQ(rows, 2 * 3) << "in the mean, about the middle";
    }
  }
}

TEST(SoftLights, CastThePenumbraOfADisc) {
  // 20 m above, .4 m of penumbra: 40 of the picture's rows.
  constexpr float height = 20, radius = 0.01F;
  for (const double row : {30.0, 33.4}) {
    MadeShot shot = under_board(row, height, {{0, 0, 1}, {3, 3, 3}, radius});
    const render::FrameResult soft = frame_of(shot);
    shot.job.effort.soft_lights = false;
    const render::FrameResult hard = frame_of(shot);
    double most = 0, squares = 0, most_hard = 0;
    for (int y = 0; y < side; ++y) {
      const double truth =
          disc_beyond(-(y - row) * metres_a_pixel / (double{height} * std::tan(double{radius})));
      for (int x = 0; x < side; ++x) {
        const double off = matte_at(soft, x, y) - truth;
        most = std::max(most, std::abs(off));
        squares += off * off / (side * side);
        most_hard = std::max(most_hard, std::abs(matte_at(hard, x, y) - truth));
      }
    }
    EXPECT_LT(std::sqrt(squares), 0.03) << row;
    EXPECT_LT(most, 0.09) << row;
    EXPECT_GT(most_hard, 0.45) << "in its middle alone the light ends in a step";
  }
}

TEST(SoftLights, CastSharpShadowsOfWhatIsNear) {
  // The light comes over the board's edge: its shadow ends .15 m, 15 rows, above it, with .8 cm of
  // penumbra.
  const render::DirectionalLight light{{0, -0.6F, 0.8F}, {3, 3, 3}, 0.015F};
  MadeShot shot = under_board(40, 0.2F, light);
  const render::FrameResult soft = frame_of(shot);
  shot.job.effort.soft_lights = false;
  const render::FrameResult hard = frame_of(shot);
  int dark = 0;
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < side; ++x) {
      dark += matte_at(hard, x, y) > 0.9;
      if (std::abs(matte_at(soft, x, y) - matte_at(hard, x, y)) < 0.02) continue;
      EXPECT_NEAR(y, 25, 1.1) << "far from the shadow's edge, in column " << x;
    }
  }
  EXPECT_GT(dark, 12 * side);
}

// The sky as so many lights of the regions that they stand for.
render::LightTable even_sky(int count) {
  render::LightTable table = even_lights(count);
  for (render::DirectionalLight& light : table.lights) {
    light.spread = std::sqrt(2 / static_cast<float>(count));
  }
  return table;
}

// Of the shadows on the floor, where nothing stands before it.
double rms_of_shadows(const render::FrameResult& a, const render::FrameResult& b) {
  double squares = 0;
  std::size_t count = 0;
  for (int y = 0; y < a.rgba.height; ++y) {
    for (int x = 0; x < a.rgba.width; ++x) {
      const std::size_t alpha = a.rgba.index(y, x, 3);
      if (a.rgba.pixels[alpha] != 0 || b.rgba.pixels[alpha] != 0) continue;
      const double off = matte_at(a, x, y) - matte_at(b, x, y);
      squares += off * off;
      ++count;
    }
  }
  return std::sqrt(squares / static_cast<double>(count));
}

TEST(SoftLights, ComeNearerToAnEvenSkyThanAsManyHardOnes) {
  MadeShot shot = made_shot(320, 240, shot_scene());
  const render::Environment sky = made_sky(64, 0.2F, 1);
  shot.job.effort.aa_samples = 1;
  const auto frame_under = [&](int count, bool soft) {
    shot.job.lights = make_light_table(sky, {.count = count});
    shot.job.effort.soft_lights = soft;
    return frame_of(shot);
  };
  const render::FrameResult truth = frame_under(2048, false);
  const auto gain = [&](int count) {
    return rms_of_shadows(truth, frame_under(count, true)) /
           rms_of_shadows(truth, frame_under(count, false));
  };
  EXPECT_LT(gain(4), 0.5);
  EXPECT_LT(gain(16), 0.55);
  EXPECT_LT(gain(64), 0.7);
}

// A grey floor with a ball over it, seen in a mirror that fills the picture.
MadeShot mirrored_shadow(bool tiles = false) {
  register_shaders();
  render::SceneDescription scene;
  scene.background = "environment";
  render::StandardParameters grey, mirror;
  std::fill_n(grey.base_color, 3, 0.5F);
  grey.roughness = 1;
  grey.specular = 0;
  if (tiles) {
    grey.base_color_texture = 0;
    const std::array<std::uint8_t, 4> texels{255, 20, 20, 255};
    scene.textures = {
        std::make_shared<render::Texture>(render::make_texture(2, 2, 1, false, texels))};
  }
  mirror.metallic = 1;
  mirror.roughness = 0;
  scene.materials = {make_standard_material("grey", grey),
                     make_standard_material("mirror", mirror)};
  auto upright = std::make_shared<render::Mesh>();
  upright->positions = {{-9, 3, -9}, {9, 3, -9}, {9, 3, 9}, {-9, 3, 9}};
  upright->triangles = {{0, 1, 2}, {0, 2, 3}};
  upright->materials = {1};
  auto floor = made_floor(20, 0);
  if (tiles) floor->uvs = {{0, 0}, {40, 0}, {40, 40}, {0, 40}};
  scene.meshes = {floor, made_ball({0, 0.4F, 0.9F}, 0.5F, 0), upright};
  for (std::uint32_t mesh = 0; mesh < 3; ++mesh) scene.instances.emplace_back().mesh = mesh;
  MadeShot shot = made_shot(160, 112, std::move(scene));
  shot.job.cam_from_set = calibrate::look_at({0, 0, 3}, {0, 3, 1.2}, 0);
  shot.job.effort.aa_samples = 1;
  return shot;
}

double rms_between(const render::FrameResult& a, const render::FrameResult& b) {
  double squares = 0;
  for (std::size_t i = 0; i < a.rgba.pixels.size(); ++i) {
    squares += std::pow(static_cast<double>(float_from_half(a.rgba.pixels[i])) -
                            static_cast<double>(float_from_half(b.rgba.pixels[i])),
                        2);
  }
  return std::sqrt(squares / static_cast<double>(a.rgba.pixels.size()));
}

// Mirrored surfaces get their light as those do that are seen at once: shared among neighbours.
TEST(SoftLights, AreAsSoftInAMirror) {
  MadeShot shot = mirrored_shadow();
  const render::Environment sky = made_sky(64, 0.2F, 1);
  const auto frame_under = [&](int count, bool soft) {
    shot.job.lights = make_light_table(sky, {.count = count});
    shot.job.effort.soft_lights = soft;
    return frame_of(shot);
  };
  const render::FrameResult truth = frame_under(2048, false);
  for (const int count : {16, 64}) {
    const render::FrameResult soft = frame_under(count, true), hard = frame_under(count, false);
    EXPECT_LT(rms_between(soft, truth), 0.75 * rms_between(hard, truth)) << count;
    // One pixel of sixteen asks where all agree.
    EXPECT_LT(hard.statistics.shadow_rays, 160U * 112U * static_cast<unsigned>(count) / 4) << count;
  }
}

// Further samples get the light of what they see in a mirror from what centres saw beside it.
TEST(SoftLights, AreNotLookedForAgainByFurtherSamplesInAMirror) {
  MadeShot shot = mirrored_shadow(true);
  shot.job.lights = even_sky(64);
  const render::FrameResult one = frame_of(shot);
  shot.job.effort.aa_samples = 16;
  shot.job.effort.aa_tolerance = 0;
  const render::FrameResult many = frame_of(shot);
  const auto more = [&](std::uint64_t render::RenderStatistics::*rays) {
    return static_cast<double>(many.statistics.*rays - one.statistics.*rays);
  };
  const double further = more(&render::RenderStatistics::primary_rays);
  EXPECT_GT(further, 3.0 * 160 * 112);
  EXPECT_LT(more(&render::RenderStatistics::shadow_rays), 4 * further);
}

// A grey floor with a ball over it, seen in a polished black wall of strips that are turned this
// way and that: hardly any 4x4 pixels mirror one smooth surface.
MadeShot faint_mirrors() {
  MadeShot shot = mirrored_shadow();
  render::SceneDescription scene = shot.scene->description();
  render::StandardParameters black;
  std::fill_n(black.base_color, 3, 0.0F);
  black.roughness = 0;
  scene.materials[1] = make_standard_material("black", black);
  auto wall = std::make_shared<render::Mesh>();
  constexpr int strips = 120;
  for (int i = 0; i < strips; ++i) {
    constexpr float width = 18.0F / strips;
    const float left = -9 + width * static_cast<float>(i), right = left + width;
    const float y = i % 2 == 0 ? 3.02F : 3, other = 6.02F - y;
    const auto at = static_cast<std::uint32_t>(wall->positions.size());
    wall->positions.insert(wall->positions.end(),
                           {{left, y, -9}, {right, other, -9}, {right, other, 9}, {left, y, 9}});
    wall->triangles.insert(wall->triangles.end(), {{at, at + 1, at + 2}, {at, at + 2, at + 3}});
    wall->materials.insert(wall->materials.end(), 2, 1);
  }
  scene.meshes[2] = wall;
  shot.scene = std::make_unique<render::Scene>(std::move(scene));
  return shot;
}

// What counts little of a pixel tests a few lights, each pixel others: all of them together.
TEST(SoftLights, OfFaintMirrorsAreAllOfThemFromPixelToPixel) {
  MadeShot shot = faint_mirrors();
  shot.job.lights = make_light_table(made_sky(64, 0.2F, 1), {.count = 256});
  shot.job.effort.accuracy = 1;
  const render::FrameResult all = frame_of(shot);
  shot.job.effort.accuracy = 0.99F;
  const render::FrameResult few = frame_of(shot);
  EXPECT_LT(few.statistics.shadow_rays, all.statistics.shadow_rays * 3 / 4);
  constexpr int group = 8;
  double squares = 0, truth = 0;
  for (int y = 0; y < all.rgba.height; y += group) {
    for (int x = 0; x < all.rgba.width; x += group) {
      double off = 0, sum = 0;
      for (int i = 0; i < group * group; ++i) {
        const std::size_t at = all.rgba.index(y + i / group, x + i % group);
        const auto light = [at](const render::FrameResult& frame) {
          return static_cast<double>(float_from_half(frame.rgba.pixels[at]));
        };
        off += light(few) - light(all);
        sum += light(all);
      }
      squares += off * off, truth += sum * sum;
    }
  }
  EXPECT_LT(std::sqrt(squares / truth), 0.003) << "the brightest of each few alone err by .007";
}

// What lies under a clear coat mirrors the same as that: it has the light of what that shows.
TEST(SoftLights, UnderAClearCoatAreLookedForOnce) {
  const auto rays_of = [](float coat) {
    MadeShot shot = mirrored_shadow();
    shot.job.lights = even_sky(64);
    shot.job.effort.accuracy = 1;
    render::SceneDescription scene = shot.scene->description();
    render::StandardParameters polished;
    std::fill_n(polished.base_color, 3, 0.0F);
    polished.roughness = 0;
    polished.clearcoat = coat;
    polished.clearcoat_roughness = 0;
    scene.materials[1] = make_standard_material("polished", polished);
    shot.scene = std::make_unique<render::Scene>(std::move(scene));
    return frame_of(shot).statistics;
  };
  const render::RenderStatistics bare = rays_of(0), coated = rays_of(1);
  EXPECT_GT(coated.secondary_rays, bare.secondary_rays * 3 / 2);
  EXPECT_LT(coated.shadow_rays, bare.shadow_rays * 6 / 5);
}

// A sun's shadows in a mirror are asked for pixel by pixel: they may be as small as a pixel.
TEST(CompactLights, AreAskedForInMirrorsAsIfThereWereNoGrid) {
  MadeShot shot = mirrored_shadow();
  shot.job.lights.lights = {{normalize(Vec3f{0.5F, -0.6F, 0.8F}), {3, 3, 3}, 0.005F, 1}};
  const render::FrameResult adaptive = frame_of(shot);
  shot.job.effort.adaptive_visibility = false;
  EXPECT_EQ(adaptive.rgba.pixels, frame_of(shot).rgba.pixels);
}

// Pixels at the border of a cell share with none beyond it: they go on as those beside them do.
TEST(SoftLights, AreSharedAsEvenlyAtTheBorderOfACell) {
  constexpr std::size_t count = 16;
  const std::vector<render::DirectionalLight> lights(count, {{0, 0, 1}, {1, 2, 3}, 0.1F});
  for (const bool across : {true, false}) {
    // More and more of the lights are hidden, from one side of the cell to the other.
    const auto hidden = [&](std::size_t k) {
      return (static_cast<float>(across ? k % 16 : k / 16) + 0.5F) / 16;
    };
    render::CellMask all;
    all.fill(~std::uint64_t{0});
    render::CellVisibility visibility;
    visibility.lit.assign(count, all);
    visibility.seen.assign(count, {});
    visibility.near.assign(count, {});
    alignas(64) std::array<float, render::cell_pixels> zero{}, one;
    one.fill(1);
    for (std::size_t k = 0; k < render::cell_pixels; ++k) {
      for (std::size_t light = 0; light < count; ++light) {
        const bool sees = static_cast<float>(light) + 0.5F > 16 * hidden(k);
        if (sees) visibility.seen[light][k / 64] |= std::uint64_t{1} << (k % 64);
      }
      const std::size_t x = std::clamp<std::size_t>(k % 16, 1, 13) - 1;
      const std::size_t y = std::clamp<std::size_t>(k / 16, 1, 13) - 1;
      visibility.windows.push_back(
          {static_cast<std::uint8_t>(k), static_cast<std::uint8_t>(y * 16 + x), 0xFFFF});
    }
    const auto sums = std::make_unique<render::LightSums>();
    const auto soft = std::make_unique<render::LightSums>();
    add_up_light({all, zero, zero, one}, lights, visibility, *sums, *soft);
    for (std::size_t k = 0; k < render::cell_pixels; ++k) {
      ASSERT_NEAR(sums->lost(k).y / sums->open(k).y, hidden(k), 0.04) << k % 16 << ", " << k / 16;
    }
  }
}

// What counts little tests one of a few lights: neighbours in the sky, that one can stand for.
TEST(SoftLights, StandSideBySideInTheOrderOfTheirPlaces) {
  render::LightTable table = even_lights(256);
  table.lights[7].compact = 1;
  const std::vector<std::uint16_t> order = render::order_by_place(table.lights);
  const std::set<std::uint16_t> each(order.begin(), order.end());
  EXPECT_EQ(order.size(), 255U);
  EXPECT_EQ(each.size(), 255U);
  EXPECT_FALSE(each.contains(7)) << "a compact light is tested by all";
  double apart = 0;
  for (std::size_t i = 0; i + 4 <= order.size(); i += 4) {
    for (std::size_t k = 1; k < 4; ++k) {
      apart += std::acos(std::min(1.0F, dot(table.lights[order[i]].direction,
                                            table.lights[order[i + k]].direction))) /
               191;
    }
  }
  // Neighbours are .16 rad apart, lights at random 1.2.
  EXPECT_LT(apart, 0.35);
}

// A matte wall under a roof that hides some of the lights, and how much the wall's light differs
// from pixel to pixel in a part of the picture, as a share of its most.
render::SceneDescription wall_under_roof() {
  render::SceneDescription scene = shot_scene(false);
  scene.instances.clear();
  render::StandardParameters wall;
  wall.roughness = 1;
  wall.specular = 0;
  scene.materials = {render::make_standard_material("wall", wall)};
  auto upright = std::make_shared<render::Mesh>();
  upright->positions = {{-20, 4, 0}, {20, 4, 0}, {20, 4, 9}, {-20, 4, 9}};
  upright->triangles = {{0, 1, 2}, {0, 2, 3}};
  upright->materials = {0};
  auto roof = std::make_shared<render::Mesh>();
  roof->positions = {{-20, 2.5F, 4}, {20, 2.5F, 4}, {20, 4, 4}, {-20, 4, 4}};
  roof->triangles = {{0, 1, 2}, {0, 2, 3}};
  roof->materials = {0};
  scene.meshes = {upright, roof};
  for (std::uint32_t mesh = 0; mesh < 2; ++mesh) scene.instances.emplace_back().mesh = mesh;
  return scene;
}

double grain_of(MadeShot shot, render::Rect part) {
  shot.job.effort.aa_samples = 1;
  const render::FrameResult frame = frame_of(shot);
  double grain = 0, light = 0;
  for (int y = part.y; y < part.y + part.height; ++y) {
    for (int x = part.x; x < part.x + part.width; ++x) {
      const auto at = [&](int column) {
        return static_cast<double>(
            float_from_half(frame.rgba.pixels[frame.rgba.index(y, column, 1)]));
      };
      grain = std::max(grain, std::abs(at(x) - 0.5 * (at(x - 1) + at(x + 1))));
      light = std::max(light, at(x));
    }
  }
  EXPECT_GT(light, 0.01);
  return grain / light;
}

// What one light of eight tells is no grain from pixel to pixel.
TEST(SoftLights, ShowNoGrainInDimMirrors) {
  render::SceneDescription scene = wall_under_roof();
  render::StandardParameters mirror;
  mirror.roughness = 0;
  std::fill_n(mirror.base_color, 3, 0.01F);
  scene.materials.push_back(render::make_standard_material("mirror", mirror));
  scene.meshes.push_back(made_floor(20, 1));
  scene.instances.emplace_back().mesh = 2;
  MadeShot shot = made_shot(64, 48, std::move(scene), 64);
  shot.job.cam_from_set = calibrate::look_at({0, -3, 1.5}, {0, 2, 0}, 0);
  EXPECT_LT(grain_of(std::move(shot), {8, 24, 48, 16}), 0.025);
}

// What is seen through the haze about a person, whose neighbours share nothing.
TEST(SoftLights, ShowNoGrainBehindHaze) {
  MadeShot shot = made_shot(64, 48, wall_under_roof(), 64);
  render::SceneDescription scene = wall_under_roof();
  scene.materials.push_back(make_billboard_material("person", {}));
  scene.meshes.push_back(std::make_shared<render::Mesh>(make_billboard_mesh(1)));
  render::Instance& person = scene.instances.emplace_back();
  person.mesh = 2, person.moves = true;
  person.set_from_object = {8, 0, 0, 0, 0, 1, 0, 0, 0, 0, 4, 0};
  capture::Image haze = capture::make_image(8, 8, 4);
  for (int pixel = 0; pixel < 64; ++pixel) haze.at(pixel / 8, pixel % 8, 3) = 0.01F;
  const auto picture = std::make_shared<KeyedPicture>(make_keyed_texture(haze));
  shot.scene = std::make_unique<render::Scene>(std::move(scene), render::Scene::Pictures{picture});
  shot.job.cam_from_set = calibrate::look_at({0, -3, 1.5}, {0, 2, 1.5}, 0);
  MadeShot bare = made_shot(64, 48, wall_under_roof(), 64);
  bare.job.cam_from_set = shot.job.cam_from_set;
  constexpr render::Rect part{8, 8, 48, 24};
  // Where the roof touches the wall, a light's edge is as sharp as pixels are.
  EXPECT_LT(grain_of(std::move(shot), part), 1.05 * grain_of(std::move(bare), part));
}

TEST(SoftLights, AreCulledOnlyWhereNoPartOfThemIsHidden) {
  for (const int count : {1, 3, 12, 64}) {
    MadeShot shot = made_shot(160, 96, shot_scene());
    shot.job.lights = even_sky(count);
    shot.job.effort.aa_samples = 1;
    const render::FrameResult culled = frame_of(shot);
    shot.job.effort.cull_lights = false;
    const render::FrameResult all = frame_of(shot);
    EXPECT_EQ(culled.rgba.pixels, all.rgba.pixels) << count << " lights";
    EXPECT_EQ(culled.matte.pixels, all.matte.pixels) << count << " lights";
    EXPECT_LT(culled.statistics.shadow_rays, all.statistics.shadow_rays);
  }
}

TEST(SoftLights, LeaveThePlateItsBitsWhereNothingIsHidden) {
  MadeShot shot = made_shot(96, 64, shot_scene(false));
  shot.job.lights = even_sky(16);
  const render::FrameResult frame = frame_of(shot);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 96; ++x) {
      for (int c = 0; c < 3; ++c) {
        ASSERT_EQ(frame.rgba.pixels[frame.rgba.index(y, x, c)],
                  shot.plate.pixels[shot.plate.index(y, x, c)]);
      }
    }
  }
}

// Where the method ends: regions as wide as the sky, or wider, and lights below the ground.
TEST(SoftLights, StayFiniteHoweverWideTheyAre) {
  for (const float spread :
       {-1.0F, 1e-30F, 1e-6F, 0.5F, 1.0F, 1.6F, 3.0F, 100.0F,
        std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    MadeShot shot = made_shot(96, 64, shot_scene());
    shot.job.lights = even_lights(8);
    shot.job.lights.lights.push_back({{0, 0, -1}, {1, 1, 1}, spread});
    for (render::DirectionalLight& light : shot.job.lights.lights) light.spread = spread;
    const render::FrameResult frame = frame_of(shot);
    for (const capture::Half pixel : frame.rgba.pixels) {
      ASSERT_TRUE(std::isfinite(float_from_half(pixel))) << spread;
    }
    for (const capture::Half pixel : frame.matte.pixels) {
      ASSERT_TRUE(float_from_half(pixel) >= 0 && float_from_half(pixel) <= 1) << spread;
    }
  }
}

}  // namespace
}  // namespace compositing::soft_lights_test
