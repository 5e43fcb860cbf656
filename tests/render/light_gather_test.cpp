// Who sees which light, against rays one by one.
#include "render/light_gather.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "plain_shapes.h"
#include "render/shadow_stream.h"
#include "render/trace.h"
#include "render/visibility_finder.h"

namespace render::light_gather_test {
namespace {

class LightGather : public testing::Test {
 protected:
  LightGather() {
    effort_.adaptive_visibility = false;
    effort_.interleave = 1;
    receivers_ = std::make_unique<Receivers>();
    Receivers& r = *receivers_;
    for (std::size_t k = 0; k < cell_pixels; ++k) {
      const Vec3f n = direction(), g = normalize(n + direction() * 0.3F);
      r.px[k] = 2 * any(), r.py[k] = 2 * any(), r.pz[k] = 2 * any();
      r.nx[k] = n.x, r.ny[k] = n.y, r.nz[k] = n.z;
      r.gx[k] = g.x, r.gy[k] = g.y, r.gz[k] = g.z;
      r.surface[k] = static_cast<std::uint32_t>(k);
      r.mask[k] = mask_virtual | mask_real_blocker;
      r.real_first[k] = 0;
      r.part[k] = static_cast<std::uint8_t>(k % 3 == 0 ? SoftLights::middle : k % 16);
      r.share[k] = 1;
    }
    // Some receive nothing, as in a cell that is partly sky.
    for (std::size_t word = 0; word < 4; ++word) {
      r.active[word] = ~(std::uint64_t{0xF0F} << 13 * word);
    }
    r.by_lamps = r.by_caustics = r.active;
    for (int i = 0; i < 75; ++i) {
      table_.lights.push_back({.direction = direction(),
                               .irradiance = {1 + any(), 1 + any(), 1 + any()},
                               .spread = 0.1F,
                               .compact = i % 9 == 0 ? 1U : 0U});
    }
    for (int i = 0; i < 70; ++i) {
      LocalLight lamp;
      lamp.position = {3 * any(), 3 * any(), 3 * any()};
      lamp.intensity = {1, 1, 1};
      lamp.normal = i % 3 == 0 ? Vec3f{} : direction();
      lamp.area_m2 = i % 4 == 0 ? 0.0F : 0.2F + 0.1F * any();
      lamp.ambient = i % 17 == 5 ? 1 : 0;
      if (i % 19 == 7) lamp.intensity = {};
      table_.lamps.push_back(lamp);
    }
  }

  float any() { return numbers_(random_); }
  Vec3f direction() {
    for (;;) {
      const Vec3f v{any(), any(), any()};
      if (dot(v, v) > 0.01F && dot(v, v) < 1) return normalize(v);
    }
  }
  // Things that hide about a third; some of coloured glass.
  SceneDescription things(bool glass) {
    SceneDescription all = make_scene(make_box({-0.7F, -0.7F, -0.7F}, {0.5F, 0.6F, 0.2F}), {});
    auto sphere = std::make_shared<Mesh>(*make_sphere(0.6F, 12));
    sphere->materials = {1};
    all.meshes.push_back(sphere);
    StandardParameters thin;
    thin.base_color[1] = 0.5F;
    thin.transmission = glass ? 0.7F : 0;
    all.materials.push_back(make_standard_material("ball", thin));
    Instance ball;
    ball.mesh = 1;
    ball.set_from_object = {1, 0, 0, 1.1F, 0, 1, 0, -0.3F, 0, 0, 1, 0.4F};
    all.instances.push_back(ball);
    return all;
  }
  LightContext context(const Scene& scene) {
    rows_ = LightRows(table_.lights);
    LightContext context;
    context.scene = &scene;
    context.table = &table_;
    context.effort = &effort_;
    context.rows = &rows_;
    return context;
  }
  Vec3f origin(std::size_t k) const {
    return {receivers_->px[k], receivers_->py[k], receivers_->pz[k]};
  }
  bool shines_on(std::size_t k, Vec3f l) const {
    const Receivers& r = *receivers_;
    return r.nx[k] * l.x + r.ny[k] * l.y + r.nz[k] * l.z > 0 &&
           r.gx[k] * l.x + r.gy[k] * l.y + r.gz[k] * l.z > 0;
  }
  // What lets a lamp's light by, per intensity.
  Vec3f from_lamp(const Scene& scene, std::size_t k, const LocalLight& lamp) const {
    const auto ray = ray_to_lamp(lamp_receiver(*receivers_, k), lamp);
    if (!ray) return {};
    if (!(ray->far_m > 0)) return Vec3f{1, 1, 1} * ray->per_intensity;
    return transmittance(scene, origin(k), ray->direction, 0, ray->far_m,
                         mask_virtual | mask_real_blocker) *
           ray->per_intensity;
  }

  std::mt19937 random_{7};
  std::uniform_real_distribution<float> numbers_{-1, 1};
  Effort effort_;
  LightTable table_;
  LightRows rows_;
  std::unique_ptr<Receivers> receivers_;
  std::unique_ptr<GatherWorkspace> workspace_ = std::make_unique<GatherWorkspace>();
  RenderStatistics statistics_;
};

TEST_F(LightGather, OfACellIsThatOfEveryPixelsOwnRays) {
  for (const bool glass : {false, true}) {
    const Scene scene(things(glass));
    ASSERT_EQ(scene.has_filters(), glass);
    workspace_->tints.reserve(GatherWorkspace::group * cell_pixels);
    CellVisibility visibility;
    gather_cell(context(scene), *receivers_, *workspace_, visibility, statistics_);
    std::size_t hidden = 0, tinted = 0;
    for (std::size_t i = 0; i < table_.lights.size(); ++i) {
      const Vec3f to = table_.lights[i].direction;
      for (std::size_t k = 0; k < cell_pixels; ++k) {
        const bool lit = in(receivers_->active, k) && shines_on(k, to);
        ASSERT_EQ(in(visibility.lit[i], k), lit) << i << ' ' << k;
        if (!lit) continue;
        const Vec3f passes = transmittance(scene, origin(k), to, 0, ray_far, receivers_->mask[k]);
        ASSERT_EQ(in(visibility.seen[i], k), passes != Vec3f{}) << i << ' ' << k;
        hidden += passes == Vec3f{};
        tinted += passes != Vec3f{} && passes != Vec3f{1, 1, 1};
      }
    }
    EXPECT_GT(hidden, 500U);
    EXPECT_EQ(visibility.tints.size(), tinted);
    for (const TintedLight& tint : visibility.tints) {
      const Vec3f passes =
          transmittance(scene, origin(tint.centre), table_.lights[tint.light].direction, 0, ray_far,
                        receivers_->mask[tint.centre]);
      const Vec3f apart = passes - (Vec3f{1, 1, 1} - tint.lost_share);
      EXPECT_LT(length(apart), 1e-6F) << tint.light << ' ' << tint.centre;
    }
  }
}

TEST_F(LightGather, OfTwoSurfacesThatMeetTakesFewRays) {
  // A wall stands on a floor, slanting through the cell, and a box hangs before both.
  Receivers& r = *receivers_;
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    const auto x = static_cast<float>(k % cell_size), y = static_cast<float>(k / cell_size);
    const float from_wall = y - 5.3F - 0.4F * x;  // in pixels
    const bool floor = from_wall > 0;
    const Vec3f n = floor ? Vec3f{0, 0, 1} : Vec3f{0, -1, 0};
    r.px[k] = 0.1F * x - 0.8F;
    r.py[k] = floor ? -0.1F * from_wall : -1e-3F;
    r.pz[k] = floor ? 1e-3F : -0.1F * from_wall;
    r.nx[k] = r.gx[k] = n.x, r.ny[k] = r.gy[k] = n.y, r.nz[k] = r.gz[k] = n.z;
    r.surface[k] = floor;
    r.share[k] = 1;
  }
  r.active = {~0ULL, ~0ULL, ~0ULL, ~0ULL};
  const Scene scene(make_scene(make_box({-0.5F, -1.2F, 0.8F}, {0.3F, -0.3F, 1.1F}), {}));
  workspace_->tints.reserve(GatherWorkspace::group * cell_pixels);
  const auto gather = [&](bool adaptive) {
    effort_.adaptive_visibility = adaptive;
    statistics_ = {};
    CellVisibility visibility;
    gather_cell(context(scene), r, *workspace_, visibility, statistics_);
    return visibility;
  };
  const CellVisibility all = gather(false);
  const std::uint64_t all_rays = statistics_.shadow_rays;
  const CellVisibility few = gather(true);
  EXPECT_LT(statistics_.shadow_rays, all_rays / 2);
  std::size_t lit = 0, hidden = 0, wrong = 0;
  for (std::size_t i = 0; i < table_.lights.size(); ++i) {
    for (std::size_t k = 0; k < cell_pixels; ++k) {
      ASSERT_EQ(in(few.lit[i], k), in(all.lit[i], k));
      if (!in(all.lit[i], k)) continue;
      const bool differs = in(few.seen[i], k) != in(all.seen[i], k);
      ++lit, hidden += !in(all.seen[i], k), wrong += differs;
    }
  }
  EXPECT_GT(hidden, lit / 20);
  EXPECT_LT(wrong, lit / 200);
}

TEST_F(LightGather, EndsWherePixelsHaveNoNormalOrPlace) {
  // What only mirrors has no normal for dull light.
  Receivers& r = *receivers_;
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    r.surface[k] = k % 3 == 0;
    if (k % 5 == 0) r.nx[k] = r.ny[k] = r.nz[k] = 0;
    if (k % 7 == 0) r.px[k] = r.ny[k] = std::numeric_limits<float>::quiet_NaN();
  }
  effort_.adaptive_visibility = true;
  const Scene scene(things(false));
  CellVisibility visibility;
  gather_cell(context(scene), r, *workspace_, visibility, statistics_);
  std::uint64_t pixels[4]{};
  std::size_t all = 0;
  for (std::size_t i = 0; i < workspace_->region_count; ++i) {
    const GatherWorkspace::Region& region = workspace_->regions[i];
    EXPECT_EQ(pixels[region.word] & region.pixels, 0U) << "each pixel is in one";
    pixels[region.word] |= region.pixels, all += region.pixels != 0;
  }
  EXPECT_EQ(all, workspace_->region_count);
  for (std::size_t word = 0; word < 4; ++word) EXPECT_EQ(pixels[word], r.active[word]);
}

TEST_F(LightGather, KnowsThe2x2BlocksOfPixels) {
  for (int i = 0; i < 200; ++i) {
    CellMask pixels{};
    for (int n = i; n >= 0; --n) {
      const std::size_t k = random_() % cell_pixels;
      pixels[k / 64] |= std::uint64_t{1} << (k % 64);
    }
    const Quads quads = quads_of(pixels), about = grown(quads);
    const CellMask whole = pixels_of(quads);
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 8; ++x) {
        const auto any_at = [&pixels](int column, int row) {
          bool any = false;
          for (int k = 0; k < 4 && column >= 0 && column < 8 && row >= 0 && row < 8; ++k) {
            any = any || in(pixels, static_cast<std::size_t>((2 * row + k / 2) * cell_size +
                                                             2 * column + k % 2));
          }
          return any;
        };
        bool near = false;
        for (int k = 0; k < 9; ++k) near = near || any_at(x + k % 3 - 1, y + k / 3 - 1);
        ASSERT_EQ(quads >> (8 * y + x) & 1, any_at(x, y) ? 1U : 0U);
        ASSERT_EQ(about >> (8 * y + x) & 1, near ? 1U : 0U);
        for (int k = 0; k < 4; ++k) {
          ASSERT_EQ(
              in(whole, static_cast<std::size_t>((2 * y + k / 2) * cell_size + 2 * x + k % 2)),
              any_at(x, y));
        }
      }
    }
  }
}

TEST_F(LightGather, OfPointsIsThatOfEveryPointsOwnRays) {
  const Scene scene(things(false));
  receivers_->count = 203;
  std::vector<PointLight> tested;
  gather_points(context(scene), *receivers_, *workspace_, tested, statistics_);
  std::size_t expected = 0;
  for (std::size_t k = 0; k < 203; ++k) {
    for (const DirectionalLight& light : table_.lights) expected += shines_on(k, light.direction);
  }
  EXPECT_EQ(tested.size(), expected);
  std::size_t hidden = 0;
  for (const PointLight& t : tested) {
    const Vec3f to = table_.lights[t.light].direction;
    const Receivers& r = *receivers_;
    ASSERT_TRUE(shines_on(t.point, to));
    EXPECT_EQ(t.weight, r.nx[t.point] * to.x + r.ny[t.point] * to.y + r.nz[t.point] * to.z);
    const Vec3f passes = transmittance(scene, origin(t.point), to, 0, ray_far, r.mask[t.point]);
    EXPECT_EQ(t.passed, passes);
    hidden += passes == Vec3f{};
  }
  EXPECT_GT(hidden, 300U);
}

// Where a point counts little, one light of several stands for all: what it stands for is what all
// of them would give, and compact ones are tested all the same.
TEST_F(LightGather, OfFaintPointsHasAllOfTheLight) {
  const Scene scene(things(false));
  effort_.accuracy = 0.9F;
  receivers_->count = 100;
  std::fill_n(receivers_->share.begin(), 100, 0.1F);
  std::vector<PointLight> tested;
  gather_points(context(scene), *receivers_, *workspace_, tested, statistics_);
  for (std::size_t k = 0; k < 100; ++k) {
    double all = 0, stood_for = 0;
    std::size_t lights = 0, compact = 0, asked = 0;
    for (const DirectionalLight& light : table_.lights) {
      if (!shines_on(k, light.direction)) continue;
      const Receivers& r = *receivers_;
      const Vec3f e =
          light.irradiance *
          (r.nx[k] * light.direction.x + r.ny[k] * light.direction.y + r.nz[k] * light.direction.z);
      all += e.x + e.y + e.z;
      ++lights;
      compact += light.compact;
    }
    for (const PointLight& t : tested) {
      if (t.point != k) continue;
      const Vec3f e = table_.lights[t.light].irradiance * t.weight;
      stood_for += e.x + e.y + e.z;
      ++asked;
      compact -= table_.lights[t.light].compact;
    }
    EXPECT_NEAR(stood_for, all, 1e-4 * all);
    EXPECT_EQ(compact, 0U);
    if (lights > 16) {
      EXPECT_LT(asked, lights);
    }
  }
}

TEST_F(LightGather, OfLampsIsThatOfEveryPointsOwnRays) {
  for (const bool glass : {false, true}) {
    const Scene scene(things(glass));
    workspace_->tints.reserve(GatherWorkspace::group * cell_pixels);
    CellLamps cell;
    gather_cell_lamps(context(scene), *receivers_, *workspace_, cell, statistics_);
    std::vector<Vec3f> got(table_.lamps.size() * cell_pixels);
    for (std::size_t place = 0; place < cell.numbers.size(); ++place) {
      for (std::size_t k = 0; k < cell_pixels; ++k) {
        got[cell.numbers[place] * cell_pixels + k] = Vec3f{1, 1, 1} * cell.factors[place].at[k];
      }
    }
    EXPECT_TRUE(std::ranges::is_sorted(cell.tints, {}, key_of));
    EXPECT_EQ(cell.tints.empty(), !glass);
    for (std::size_t place = 0; place < cell.numbers.size(); ++place) {
      for (std::size_t k = 0; k < cell_pixels; ++k) {
        Vec3f& of = got[cell.numbers[place] * cell_pixels + k];
        of = of * cell.passed(place, k);
      }
      for (const TintedLight& tint : cell.tints_of(place)) EXPECT_EQ(tint.light, place);
    }
    receivers_->count = cell_pixels;
    std::vector<PointLamp> reached;
    gather_point_lamps(context(scene), *receivers_, *workspace_, reached, statistics_);
    std::vector<Vec3f> by_points(got.size());
    for (const PointLamp& l : reached) {
      by_points[l.lamp * std::size_t{cell_pixels} + l.point] += l.factor();
    }
    std::size_t lit = 0;
    for (std::size_t i = 0; i < table_.lamps.size(); ++i) {
      for (std::size_t k = 0; k < cell_pixels; ++k) {
        const bool asked = in(receivers_->active, k) && table_.lamps[i].intensity != Vec3f{};
        const Vec3f expected = asked ? from_lamp(scene, k, table_.lamps[i]) : Vec3f{};
        EXPECT_NEAR(got[i * cell_pixels + k].x, expected.x, 1e-6F + 1e-5F * expected.x)
            << i << ' ' << k;
        EXPECT_NEAR(got[i * cell_pixels + k].z, expected.z, 1e-6F + 1e-5F * expected.x)
            << i << ' ' << k;
        EXPECT_NEAR(by_points[i * cell_pixels + k].x, expected.x, 1e-6F + 1e-5F * expected.x);
        EXPECT_NEAR(by_points[i * cell_pixels + k].z, expected.z, 1e-6F + 1e-5F * expected.x);
        lit += expected != Vec3f{};
      }
    }
    EXPECT_GT(lit, 500U);
  }
}

TEST_F(LightGather, HasWaysOfEightPointsAsOfOne) {
  const Receivers& r = *receivers_;
  for (const LocalLight& lamp : table_.lamps) {
    if (lamp.ambient != 0) continue;
    for (std::size_t first = 0; first < cell_pixels; first += 8) {
      const auto eight = [first](const auto& x, const auto& y, const auto& z) {
        return calibrate::Vec3T<Eight>{load_eight(&x[first]), load_eight(&y[first]),
                                       load_eight(&z[first])};
      };
      const LampWay<Eight> ways = way_to_lamp(eight(r.px, r.py, r.pz), eight(r.nx, r.ny, r.nz),
                                              eight(r.gx, r.gy, r.gz), lamp);
      for (std::size_t i = 0; i < 8; ++i) {
        const auto one = ray_to_lamp(lamp_receiver(r, first + i), lamp);
        ASSERT_EQ(one.has_value(), ways.shines[i] != 0);
        if (!one) continue;
        EXPECT_EQ(one->per_intensity, ways.per_intensity[i]);
        EXPECT_EQ(one->direction,
                  (Vec3f{ways.direction.x[i], ways.direction.y[i], ways.direction.z[i]}));
        EXPECT_EQ(one->far_m, ways.distance_m[i] * before_lamp);
      }
    }
  }
}

}  // namespace
}  // namespace render::light_gather_test
