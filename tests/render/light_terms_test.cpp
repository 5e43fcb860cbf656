#include "render/light_terms.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <utility>

namespace render::light_terms_test {
namespace {

using calibrate::Vec3f;
using Key = std::pair<std::uint16_t, std::uint16_t>;

std::map<Key, float> red_of(std::span<const LightTerms::Term> terms) {
  std::map<Key, float> red;
  for (const LightTerms::Term& term : terms) red[{term.slot, term.light}] += term.weight.x;
  return red;
}

TEST(LightTerms, AreOneForEachLightOfASlot) {
  LightTerms terms;
  std::mt19937 random(4);
  std::map<Key, float> expected;
  // More than fit without being joined on the way, of slots behind pictures too.
  for (int i = 0; i < 300'000; ++i) {
    const auto slot = static_cast<std::uint16_t>(random() % 40 * 400);
    const auto light = static_cast<std::uint16_t>(random() % 90 * 7);
    const auto weight = static_cast<float>(random() % 16);
    terms.add({slot, light, {weight, 0, 0}});
    expected[{slot, light}] += weight;
  }
  const auto joined = terms.join();
  EXPECT_EQ(joined.size(), expected.size());
  EXPECT_EQ(red_of(joined), expected);
  EXPECT_TRUE(std::ranges::is_sorted(joined, [](const auto& a, const auto& b) {
    return std::pair(a.slot, a.light) < std::pair(b.slot, b.light);
  }));
  terms.clear();
  EXPECT_TRUE(terms.empty());
  EXPECT_TRUE(terms.join().empty());
}

TEST(LightTerms, AsideAreForgotten) {
  LightTerms terms;
  terms.add({1, 2, {1, 1, 1}});
  terms.begin_aside();
  for (int i = 0; i < 100'000; ++i) terms.add({1, 2, {1, 1, 1}});
  terms.end_aside();
  terms.add({0, 2, {5, 5, 5}});
  EXPECT_EQ(red_of(terms.join()), (std::map<Key, float>{{{0, 2}, 5.0F}, {{1, 2}, 1.0F}}));
}

}  // namespace
}  // namespace render::light_terms_test
