// The response of a bracket: candidates, the choice between them, and what shots must have.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <future>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "capture/comparagram.h"
#include "capture/curve_family.h"
#include "capture/median.h"
#include "capture/response.h"
#include "capture/response_fit.h"

namespace capture {
namespace {

std::vector<double> claimed_exposures(std::span<const CodedShot> shots) {
  if (shots.size() < 3) throw std::invalid_argument("a response needs three shots or more");
  std::vector<double> claimed;
  for (const CodedShot& shot : shots) {
    if (!(shot.exposure_s > 0) || !std::isfinite(shot.exposure_s)) {
      throw std::invalid_argument("an exposure time is above 0");
    }
    if (shot.still.width != shots[0].still.width || shot.still.height != shots[0].still.height ||
        shot.still.channels < 3) {
      throw std::invalid_argument("the shots of a bracket need one size");
    }
    claimed.push_back(std::log(shot.exposure_s));
  }
  return claimed;
}

// The share of the codes of all shots from `low` to `high`.
double share_of_codes(std::span<const CodedShot> shots, int low, int high) {
  std::size_t count = 0;
  std::size_t all = 0;
  for (const CodedShot& shot : shots) {
    for (const std::uint8_t code : shot.still.texels) count += code >= low && code <= high ? 1 : 0;
    all += shot.still.texels.size();
  }
  return static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(1, all));
}

std::runtime_error too_little_shared(std::span<const CodedShot> shots) {
  constexpr double nearly_all = 0.9;
  const auto [shortest, longest] = std::minmax_element(
      shots.begin(), shots.end(),
      [](const CodedShot& a, const CodedShot& b) { return a.exposure_s < b.exposure_s; });
  if (longest->exposure_s < 1.3 * shortest->exposure_s) {
    return std::runtime_error(
        "all shots have one exposure, which tells nothing of the response; take shots of "
        "different exposure times");
  }
  if (share_of_codes(shots, 248, 255) > nearly_all) {
    return std::runtime_error("nearly all of the shots is saturated; take shorter exposures");
  }
  if (share_of_codes(shots, 0, 2) > nearly_all) {
    return std::runtime_error("nearly all of the shots is black; take longer exposures");
  }
  return std::runtime_error(
      "the shots share too few flat, unclipped places at different exposures to tell the response; "
      "take a scene with even surfaces and exposures closer together, or state the response (a "
      ".rsp file, or sRGB)");
}

CodeComparison enough_matches(std::span<const CodedShot> shots,
                              const std::vector<double>& claimed) {
  CodeComparison comparison = match_codes(shots);
  const std::vector<CodeMatch>& matches = comparison.matches;
  // Two shots of one exposure tell nothing about the curve.
  constexpr double different = 0.3;
  const auto useful = std::count_if(matches.begin(), matches.end(), [&](const CodeMatch& match) {
    return claimed[static_cast<std::size_t>(match.a)] - claimed[static_cast<std::size_t>(match.b)] >
           different;
  });
  constexpr std::ptrdiff_t least = 100;
  if (useful < least) throw too_little_shared(shots);
  return comparison;
}

std::vector<CurveFamily> candidate_families() {
  std::vector<CurveFamily> families;
  families.push_back({CurveFamily::Kind::fixed, 0, linear_response()});
  families.push_back({CurveFamily::Kind::fixed, 0, srgb_response()});
  families.push_back({CurveFamily::Kind::power, 0, {}});
  for (int degree = 2; degree <= 6; ++degree) {
    families.push_back({CurveFamily::Kind::polynomial, degree, {}});
  }
  families.push_back({CurveFamily::Kind::free, 0, {}});
  return families;
}

// Candidates are in order of their parameters, the free curve last.
std::size_t simplest_that_suffices(std::span<const ResponseCandidate> candidates) {
  constexpr double as_good = 1.1;
  constexpr double nearly_as_good = 1.25;
  const std::size_t free = candidates.size() - 1;
  double best = std::numeric_limits<double>::infinity();
  for (const ResponseCandidate& c : candidates.first(free)) best = std::min(best, c.heldout_error);
  if (!(best <= nearly_as_good * candidates[free].heldout_error)) return free;
  const auto chosen = std::find_if(candidates.begin(), candidates.end(), [&](const auto& c) {
    return c.heldout_error <= as_good * best;
  });
  return static_cast<std::size_t>(chosen - candidates.begin());
}

std::vector<std::string> warnings_of(std::span<const CodeFall> falls, double heldout_error) {
  constexpr std::array names{"red", "green", "blue"};
  std::vector<std::string> warnings;
  for (const CodeFall& fall : falls) {
    warnings.push_back("the response is not monotone: as light grows, the codes of " +
                       std::string(names[static_cast<std::size_t>(fall.channel)]) + " fall from " +
                       std::to_string(std::lround(fall.from)) + " to " +
                       std::to_string(std::lround(fall.to)) +
                       ", so these codes stand for two lights and no curve is right for them");
  }
  constexpr double much = 0.1;
  if (heldout_error > much) {
    warnings.push_back("no curve foretells the shots better than to " +
                       std::to_string(std::lround(100 * heldout_error)) +
                       " %: does the scene stand still, and are the exposures right?");
  }
  return warnings;
}

// Exposures that stand out from how the others relate to their labels.
void warn_of_labels(std::span<const CodedShot> shots,
                    std::span<const double> exposures_s,
                    std::vector<std::string>& warnings) {
  constexpr double much = 1.25;
  std::vector<double> ratios;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    ratios.push_back(exposures_s[i] / shots[i].exposure_s);
  }
  const double usual = median(ratios);
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const double off = ratios[i] / usual;
    if (off < much && off > 1 / much) continue;
    std::array<char, 200> text{};
    std::snprintf(text.data(), text.size(),
                  "the shot of %.4g s has the light of %.4g s, as the others have it: is its "
                  "exposure right, and does the scene stand still?",
                  shots[i].exposure_s, exposures_s[i] / usual);
    warnings.emplace_back(text.data());
  }
}

}  // namespace

ResponseFit recover_response(std::span<const CodedShot> shots) {
  const std::vector<double> claimed = claimed_exposures(shots);
  const CodeComparison comparison = enough_matches(shots, claimed);
  const std::vector<CodeMatch>& matches = comparison.matches;
  const std::vector<CurveFamily> families = candidate_families();
  std::vector<std::future<HeldoutError>> errors;
  for (const CurveFamily& family : families) {
    errors.push_back(std::async(std::launch::async, [&family, &matches, &claimed] {
      return heldout_error(family, matches, claimed);
    }));
  }
  ResponseFit fit;
  std::vector<double> changed;
  for (std::size_t i = 0; i < families.size(); ++i) {
    const HeldoutError error = errors[i].get();
    changed.push_back(error.changed);
    fit.candidates.push_back({families[i].name(), CurveFamily::channels * families[i].parameters(),
                              error.by_code, error.by_pixel});
  }
  const std::size_t chosen = simplest_that_suffices(fit.candidates);
  if (!std::isfinite(fit.candidates[chosen].heldout_error)) throw too_little_shared(shots);
  constexpr double nothing_like_it = 0.3;
  if (fit.candidates[chosen].heldout_error > nothing_like_it) {
    throw std::runtime_error(
        "no curve foretells the shots better than to " +
        std::to_string(std::lround(100 * fit.candidates[chosen].heldout_error)) +
        " %: are the exposures in the shots' order, and does the scene stand "
        "still?");
  }
  const CurveFamily& family = families[chosen];
  CurveFit curve = fit_curve(family, matches, claimed);
  fit.response = family.response(curve.parameters.data());
  fit.exposures_s = std::move(curve.exposures_s);
  fit.heldout_error = fit.candidates[chosen].heldout_error;
  fit.pixel_error = fit.candidates[chosen].pixel_error;
  fit.changed = changed[chosen];
  fit.warnings = warnings_of(comparison.falls, fit.heldout_error);
  warn_of_labels(shots, fit.exposures_s, fit.warnings);
  return fit;
}

ResponseCheck check_response(const Response& response, std::span<const CodedShot> shots) {
  const std::vector<double> claimed = claimed_exposures(shots);
  const CodeComparison comparison = enough_matches(shots, claimed);
  const CurveFamily family{CurveFamily::Kind::fixed, 0, response};
  const HeldoutError error = heldout_error(family, comparison.matches, claimed);
  return {error.by_code, error.by_pixel,
          fit_curve(family, comparison.matches, claimed).exposures_s};
}

}  // namespace capture
