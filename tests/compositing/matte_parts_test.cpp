// Parts of mattes and distances to them, against searches from pixel to pixel.
#include "compositing/matte_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <queue>
#include <random>
#include <set>
#include <utility>

namespace compositing::matte_parts_test {
namespace {

// Specks that touch and branch, about half of them above .5.
Field random_field(int height, int width, unsigned seed, float share = 0.45F) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  Field field{height, width, {}};
  for (int i = 0; i < height * width; ++i) {
    field.of.push_back(uniform(random) < share ? 0.5F + 0.5F * uniform(random)
                                               : 0.499F * uniform(random));
  }
  return field;
}

bool is_in(const Field& field, int y, int x) {
  return y >= 0 && x >= 0 && y < field.height && x < field.width;
}

// Connected pixels from one on, by a search to all eight sides.
std::set<std::pair<int, int>> flood(const Field& field, float level, int y, int x) {
  std::set<std::pair<int, int>> found{{y, x}};
  std::queue<std::pair<int, int>> next;
  next.emplace(y, x);
  for (; !next.empty(); next.pop()) {
    const auto [at_y, at_x] = next.front();
    for (int v = at_y - 1; v <= at_y + 1; ++v) {
      for (int u = at_x - 1; u <= at_x + 1; ++u) {
        if (is_in(field, v, u) && field.at(v, u) >= level && found.emplace(v, u).second) {
          next.emplace(v, u);
        }
      }
    }
  }
  return found;
}

TEST(MatteParts, AreWhatASearchFromPixelToPixelFinds) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    const int height = 1 + static_cast<int>(seed * 7 % 23), width = 1 + static_cast<int>(seed);
    const Field field = random_field(height, width, seed, 0.2F + 0.015F * static_cast<float>(seed));
    const std::vector<Part> parts = parts_of(field, 0.5F);
    std::set<std::pair<int, int>> all;
    int last_first = -1;
    for (const Part& part : parts) {
      ASSERT_FALSE(part.runs.empty());
      std::set<std::pair<int, int>> own;
      int left = width, right = -1;
      for (const auto& [y, from, to] : part.runs) {
        for (int x = from; x <= to; ++x) ASSERT_TRUE(own.emplace(y, x).second);
        left = std::min(left, from), right = std::max(right, to);
      }
      EXPECT_EQ(own, flood(field, 0.5F, own.begin()->first, own.begin()->second)) << seed;
      EXPECT_EQ(part.area, own.size());
      EXPECT_EQ(part.left, left);
      EXPECT_EQ(part.right, right);
      EXPECT_EQ(part.top, own.begin()->first);
      EXPECT_EQ(part.bottom, own.rbegin()->first);
      const int first = own.begin()->first * width + own.begin()->second;
      EXPECT_GT(first, last_first);  // in the order of their first pixels
      last_first = first;
      const Field alone = only(part, height, width);
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) EXPECT_EQ(alone.at(y, x) == 1, own.contains({y, x}));
      }
      all.merge(own);
      EXPECT_TRUE(own.empty());  // in no other part
    }
    EXPECT_EQ(std::ssize(all),
              std::ranges::count_if(field.of, [](float alpha) { return alpha >= 0.5F; }));
    const Part* most = largest(parts);
    for (const Part& part : parts) EXPECT_LE(part.area, most->area);
  }
  EXPECT_EQ(largest(parts_of(Field{3, 3, std::vector<float>(9)}, 0.5F)), nullptr);
  EXPECT_TRUE(parts_of({}, 0.5F).empty());
}

TEST(MatteParts, OfASpiralAreOne) {
  // Its arms join only in the middle: known last of all.
  Field field{9, 9, std::vector<float>(81)};
  const char* rows[] = {"#########", "........#", "#######.#", "#.....#.#", "#.###.#.#",
                        "#.#...#.#", "#.#####.#", "#.......#", "#########"};
  for (int y = 0; y < 9; ++y) {
    for (int x = 0; x < 9; ++x) field.at(y, x) = rows[y][x] == '#' ? 1.0F : 0.0F;
  }
  const std::vector<Part> parts = parts_of(field, 0.5F);
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(static_cast<float>(parts[0].area), std::ranges::count(field.of, 1.0F));
}

TEST(MatteParts, DistancesAreThoseOfTheShortestWayBySidesAndCorners) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const int height = 1 + static_cast<int>(seed * 5 % 17), width = 1 + static_cast<int>(seed * 2);
    Field field = random_field(height, width, seed, 0.04F);
    for (float& v : field.of) v = v >= 0.5F ? 1.0F : 0.0F;
    for (const float of : {0.0F, 1.0F}) {
      const Grid<int> thirds = thirds_to(field, of);
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          int least = 3'000'000;
          for (int v = 0; v < height; ++v) {
            for (int u = 0; u < width; ++u) {
              if (field.at(v, u) != of) continue;
              const int far = std::abs(v - y), wide = std::abs(u - x);
              least = std::min(least, 3 * std::abs(far - wide) + 4 * std::min(far, wide));
            }
          }
          ASSERT_EQ(thirds.at(y, x), least) << seed << " " << y << " " << x;
        }
      }
    }
  }
}

}  // namespace
}  // namespace compositing::matte_parts_test
