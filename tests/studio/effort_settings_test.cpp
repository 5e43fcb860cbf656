// The dial of effort.
#include "studio/effort_settings.h"

#include <gtest/gtest.h>

namespace studio::effort_settings_test {
namespace {

TEST(EffortDial, HasTheDefaultAsItsSixthStep) {
  EXPECT_EQ(effort_dial({}).at(5).effort, render::Effort{});
}

TEST(EffortDial, AsksForMoreFromStepToStep) {
  const std::vector<EffortSetting> dial = effort_dial({});
  ASSERT_EQ(dial.size(), 8U);
  const auto allowed = [](float limit) { return limit > 0 ? limit : HUGE_VALF; };  // 0 = any
  for (std::size_t i = 1; i < dial.size(); ++i) {
    const render::Effort &less = dial[i - 1].effort, &more = dial[i].effort;
    EXPECT_GE(more.aa_samples, less.aa_samples) << i;
    EXPECT_LE(allowed(more.aa_tolerance), allowed(less.aa_tolerance)) << i;
    EXPECT_LE(allowed(more.glint_contrast), allowed(less.glint_contrast)) << i;
    EXPECT_GE(more.light_samples, less.light_samples) << i;
    EXPECT_LE(more.interleave, less.interleave) << i;
    EXPECT_LE(more.adaptive_visibility, less.adaptive_visibility) << i;
    EXPECT_GE(more.accuracy, less.accuracy) << i;
    EXPECT_NE(more, less) << i;
  }
}

}  // namespace
}  // namespace studio::effort_settings_test
