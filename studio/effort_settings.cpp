// The dial of effort.
#include "studio/effort_settings.h"

#include <fmt/format.h>

namespace studio {

std::vector<EffortSetting> effort_dial(const render::Effort& base) {
  struct Step {
    int aa_samples;
    float aa_tolerance, glint_contrast;
    int light_samples, interleave;
    bool adaptive_visibility;
    float accuracy;
  };
  constexpr Step steps[] = {{1, 0, 0, 16, 4, true, 0.9F},
                            {1, 0, 0, 32, 2, true, 0.9F},
                            {4, 0, 0, 32, 1, true, 0.95F},
                            {4, 0.4F, 0.4F, 32, 1, true, 0.95F},
                            {4, 0.2F, 0.2F, 64, 1, true, 0.95F},
                            {16, 0.05F, 0.09F, 64, 1, true, 0.97F},
                            {16, 0.03F, 0.05F, 128, 1, false, 0.98F},
                            {64, 0.02F, 0.03F, 256, 1, false, 0.99F}};
  std::vector<EffortSetting> settings;
  for (const Step& step : steps) {
    render::Effort effort = base;
    effort.aa_samples = step.aa_samples;
    effort.aa_tolerance = step.aa_tolerance;
    effort.glint_contrast = step.glint_contrast;
    effort.light_samples = step.light_samples;
    effort.interleave = step.interleave;
    effort.adaptive_visibility = step.adaptive_visibility;
    effort.accuracy = step.accuracy;
    settings.push_back({"all together", fmt::format("{}", settings.size() + 1), effort});
  }
  return settings;
}

}  // namespace studio
