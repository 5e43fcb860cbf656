// Settings of effort that charts measure.
#pragma once

#include <initializer_list>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "render/frame_job.h"

namespace studio {

// An effort to be measured, and what of a given one it changes.
struct EffortSetting {
  std::string method;
  std::string label;
  render::Effort effort;
};

// Eight steps from the fastest to the most accurate, all settings turned together. The sixth is the
// default.
std::vector<EffortSetting> effort_dial(const render::Effort& base);

// Adds an effort with one setting at other values; where that changes nothing, it is left out.
template <class T>
void vary_effort(std::vector<EffortSetting>& settings,
                 const std::string& method,
                 const render::Effort& base,
                 T render::Effort::*member,
                 std::initializer_list<T> values) {
  for (const T value : values) {
    render::Effort effort = base;
    effort.*member = value;
    if (effort != base)
      settings.push_back({method, fmt::format("{:.3g}", static_cast<double>(value)), effort});
  }
}

}  // namespace studio
