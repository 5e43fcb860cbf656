// Whether the shots of a bracket agree with what was merged from them.
#include "capture/bracket_check.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

namespace capture {
namespace {

constexpr std::size_t channels_of_codes = 3;
constexpr int far_off = 30;     // codes
constexpr int black_up_to = 2;  // the foot of a response tells nothing

// Whether light that makes a code, the last one whose value is not above it, makes another than
// this one by more than that; of a table that rises.
bool is_far_off(const CodeTable& table, int code, double light) {
  const auto value = [&](int of) { return table.value[static_cast<std::size_t>(of)]; };
  const int least_above = code + far_off + 1, least_near = code - far_off;
  return (least_above < Response::codes && value(least_above) <= light) ||
         (least_near > 0 && value(least_near) > light);
}

}  // namespace

BracketShares check_bracket(std::span<const std::uint8_t* const> shots,
                            std::span<const double> exposures_s,
                            const std::array<CodeTable, 3>& channels,
                            const Image& radiance) {
  if (shots.empty() || shots.size() != exposures_s.size() || radiance.channels != 3) {
    throw std::invalid_argument("a bracket has an exposure for each shot, and an RGB merge");
  }
  constexpr std::size_t enough = 250'000;
  const std::size_t pixels = radiance.pixels.size() / channels_of_codes;
  const std::size_t step = std::max<std::size_t>(1, pixels / enough);
  std::size_t looked = 0, contradicting = 0, saturated = 0, black = 0;
  for (std::size_t pixel = 0; pixel < pixels; pixel += step) {
    bool contradicts = false, any_bound = false, all_black = true;
    for (std::size_t c = 0; c < channels_of_codes; ++c) {
      const std::size_t i = pixel * channels_of_codes + c;
      const double light = static_cast<double>(radiance.pixels[i]);
      bool bound = true;
      for (std::size_t s = 0; s < shots.size(); ++s) {
        const int code = shots[s][i];
        contradicts = contradicts || is_far_off(channels[c], code, light * exposures_s[s]);
        bound = bound && !std::isfinite(channels[c].variance[static_cast<std::size_t>(code)]);
        all_black = all_black && code <= black_up_to;
      }
      any_bound = any_bound || bound;
    }
    ++looked;
    contradicting += contradicts ? 1 : 0;
    saturated += any_bound ? 1 : 0;
    black += all_black ? 1 : 0;
  }
  const auto share = [&](std::size_t count) {
    return static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(1, looked));
  };
  return {share(contradicting), share(saturated), share(black)};
}

std::vector<std::string> warnings_of(const BracketShares& shares) {
  constexpr double many_contradicting = 0.1, many_saturated = 0.05, nearly_all = 0.9;
  const auto percent = [](double share) { return std::to_string(std::lround(100 * share)) + " %"; };
  std::vector<std::string> warnings;
  if (shares.contradicting > many_contradicting) {
    warnings.push_back("in " + percent(shares.contradicting) +
                       " of the pixels the shots contradict each other: does the scene stand "
                       "still, and are exposures, their order and the response right?");
  }
  if (shares.saturated > many_saturated) {
    warnings.push_back(percent(shares.saturated) +
                       " of the pixels are saturated in every shot, and brighter than they look; "
                       "take a shorter exposure");
  }
  if (shares.black > nearly_all) {
    warnings.push_back(percent(shares.black) +
                       " of the pixels are black in every shot; take a longer exposure");
  }
  return warnings;
}

}  // namespace capture
