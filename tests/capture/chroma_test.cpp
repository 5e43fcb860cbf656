// Chroma samples to every pixel.
#include "capture/chroma.h"

#include <gtest/gtest.h>

#include <random>
#include <stdexcept>

namespace capture::chroma_test {
namespace {

constexpr Siting sitings[] = {Siting::first, Siting::middle, Siting::last};

// Twice the luma coordinate of chroma sample 0.
int doubled_site(int factor, Siting siting) {
  return siting == Siting::first ? 0 : siting == Siting::middle ? factor - 1 : 2 * (factor - 1);
}

TEST(WidenChroma, ReproducesEveryStraightLineExactly) {
  for (const int factor : {2, 4}) {
    for (const Siting siting : sitings) {
      const ChromaSteps steps(factor, siting);
      // A line through all samples, whose padding lies on it too: slope 2 * factor a sample makes
      // every interpolated value whole.
      std::vector<std::int32_t> padded;
      for (int j = -1; j <= 8; ++j) padded.push_back(2 * factor * j);
      std::vector<std::int32_t> wide(static_cast<std::size_t>(factor) * 8);
      widen_chroma(steps, 8, padded.data(), wide.data());
      for (int i = 0; i < factor * 8; ++i) {
        const int value = 2 * i - doubled_site(factor, siting);
        EXPECT_EQ(wide[static_cast<std::size_t>(i)], steps.units() * value)
            << "factor " << factor << ", sample " << i;
      }
    }
  }
}

TEST(WidenChroma, LeavesFullChromaAsItIs) {
  std::mt19937 random(3);
  std::vector<std::int32_t> padded(22);
  for (std::int32_t& value : padded) value = static_cast<std::int32_t>(random() % 65536);
  for (const Siting siting : sitings) {
    std::vector<std::int32_t> wide(20);
    widen_chroma(ChromaSteps(1, siting), 20, padded.data(), wide.data());
    EXPECT_EQ(wide, std::vector<std::int32_t>(padded.begin() + 1, padded.end() - 1));
  }
}

TEST(WidenChroma, KeepsCoSitedSamples) {
  const std::vector<std::int32_t> padded{7, 7, 100, 3, 3};
  std::vector<std::int32_t> wide(6);
  widen_chroma(ChromaSteps(2, Siting::first), 3, padded.data(), wide.data());
  EXPECT_EQ(wide[0], 4 * 7);
  EXPECT_EQ(wide[2], 4 * 100);
  EXPECT_EQ(wide[3], 2 * 100 + 2 * 3);
  EXPECT_EQ(wide[5], 4 * 3);
}

TEST(ChromaSteps, RefusesOtherFactors) {
  EXPECT_THROW(ChromaSteps(3, Siting::first), std::invalid_argument);
}

}  // namespace
}  // namespace capture::chroma_test
