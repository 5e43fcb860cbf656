// The light of a cell's centres, added up.
#include "render/cell_visibility.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

namespace render::cell_visibility_test {
namespace {

struct MadeCell {
  CellMask receiving{};
  alignas(64) std::array<float, cell_pixels> nx{}, ny{}, nz{};
  std::vector<DirectionalLight> lights;
  CellVisibility visibility;
};

// Lights that shine on all centres, on none or on some, and are hidden from all, none or some.
MadeCell made_cell(unsigned seed, bool all_receive) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> around(-1, 1);
  const auto some = [&] {
    CellMask mask;
    for (std::uint64_t& word : mask) word = std::uint64_t{random()} << 32 | random();
    return mask;
  };
  const CellMask all{~0ULL, ~0ULL, ~0ULL, ~0ULL};
  const auto any = [&](const CellMask& of) {
    CellMask mask = random() % 3 == 0 ? all : random() % 2 == 0 ? CellMask{} : some();
    for (std::size_t i = 0; i < mask.size(); ++i) mask[i] &= of[i];
    return mask;
  };
  MadeCell cell;
  cell.receiving = all_receive ? all : some();
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (!in(cell.receiving, k)) continue;
    const Vec3f n = normalize(Vec3f{around(random), around(random), 3});
    cell.nx[k] = n.x, cell.ny[k] = n.y, cell.nz[k] = n.z;
  }
  for (int i = 0; i < 60; ++i) {
    const Vec3f to = normalize(Vec3f{around(random), around(random), 1.5F});
    const float strength = std::pow(10.0F, 3 * around(random));
    cell.lights.push_back({to, Vec3f{1, 0.5F, 0.2F} * strength, 0.1F});
    cell.visibility.lit.push_back(any(cell.receiving));
    cell.visibility.seen.push_back(any(cell.visibility.lit.back()));
  }
  cell.visibility.tints = {{7, 100, {0.1F, 0.2F, 0.3F}}, {8, 101, {0.5F, 0.5F, 0.5F}}};
  return cell;
}

std::unique_ptr<LightSums> sums_of(const MadeCell& cell) {
  auto sums = std::make_unique<LightSums>();
  const auto soft = std::make_unique<LightSums>();
  add_up_light({cell.receiving, cell.nx, cell.ny, cell.nz}, cell.lights, cell.visibility, *sums,
               *soft);
  return sums;
}

TEST(AddUpLight, IsTheSumOfTheLightsOneByOne) {
  for (const bool all_receive : {true, false}) {
    const MadeCell cell = made_cell(all_receive ? 1 : 2, all_receive);
    const auto sums = sums_of(cell);
    for (std::size_t k = 0; k < cell_pixels; ++k) {
      Vec3f open{}, lost{};
      for (std::size_t i = 0; i < cell.lights.size(); ++i) {
        if (!in(cell.visibility.lit[i], k)) continue;
        const Vec3f n{cell.nx[k], cell.ny[k], cell.nz[k]};
        const Vec3f gives = cell.lights[i].irradiance * dot(n, cell.lights[i].direction);
        open += gives;
        if (!in(cell.visibility.seen[i], k)) lost += gives;
      }
      for (const TintedLight& tint : cell.visibility.tints) {
        if (tint.centre != k) continue;
        const Vec3f n{cell.nx[k], cell.ny[k], cell.nz[k]};
        const DirectionalLight& l = cell.lights[tint.light];
        lost += l.irradiance * tint.lost_share * dot(n, l.direction);
      }
      const float rounding = 3e-6F * open.x;
      EXPECT_NEAR(sums->open(k).x, open.x, rounding) << k;
      EXPECT_NEAR(sums->open(k).z, open.z, rounding) << k;
      EXPECT_NEAR(sums->lost(k).x, lost.x, rounding) << k;
      EXPECT_NEAR(sums->lost(k).y, lost.y, rounding) << k;
    }
  }
}

// In whatever order both sums are added up.
TEST(AddUpLight, LeavesNothingOrMoreWhereAllIsHidden) {
  MadeCell cell = made_cell(3, true);
  for (CellMask& seen : cell.visibility.seen) seen = {};
  cell.visibility.tints.clear();
  const auto sums = sums_of(cell);
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    const Vec3f left = sums->arriving(k);
    EXPECT_GE(std::min({left.x, left.y, left.z}), 0) << k;
    EXPECT_LE(left.x, 1e-6F * sums->open(k).x) << k;
  }
}

TEST(AddUpLight, LosesExactlyNothingWhereNothingIsHidden) {
  MadeCell cell = made_cell(4, false);
  cell.visibility.seen = cell.visibility.lit;
  cell.visibility.tints.clear();
  const auto sums = sums_of(cell);
  for (std::size_t k = 0; k < cell_pixels; ++k) EXPECT_EQ(sums->lost(k), Vec3f{}) << k;
}

}  // namespace
}  // namespace render::cell_visibility_test
