// Which exposures a scene needs.
#pragma once

#include <cstddef>
#include <vector>

#include "capture/camera.h"
#include "capture/hdr.h"

namespace capture {

// Radiances of a scene, sensor units per second, that are to be resolved: say, those between which
// all but a thousandth of its pixels lie.
struct RadianceRange {
  double least = 0;  // > 0
  double most = 0;
};

struct ChoiceSettings {
  NoiseModel noise;             // of linear values, 1 = saturated
  double relative_error = 0.1;  // largest deviation of a radiance, relative to it
  // The brightest radiance gets this share of saturation, so that it may become brighter.
  double fullest = 0.7;
  ExposureRange possible;  // the camera's; no longer than its frames last
};

struct ExposureChoice {
  std::vector<double> exposures_s;  // the shortest first
  double relative_error = 0;        // that was asked for, or had to be
  bool too_bright = false;          // the shortest possible exposure is too long
  bool too_dark = false;            // the longest possible exposure is too short
};

// The deviation of a radiance as the best merge of these exposures has it (Granados et al., see
// hdr.h), relative to it; infinite if all of them saturate, which a value does from `fullest` on.
double merged_error(double radiance,
                    const std::vector<double>& exposures_s,
                    const NoiseModel& noise,
                    double fullest);

// The least value whose deviation is at most the settings' error, relative to it. Throws
// std::invalid_argument if no value up to `fullest` has so small an error.
double least_resolved_value(const ChoiceSettings& settings);

// The fewest exposures whose merge resolves a scene: one resolves the values from that on whose
// noise is small enough up to `fullest`, and the next longer one begins where it ends. They are
// spread evenly, in stops, from the one that the brightest radiance needs to the one that the
// darkest does. Counts and reach follow from one exposure at each radiance; that of its neighbours
// adds little where it is needed, since they are far away.
// Throws std::invalid_argument for ranges or settings that are not above 0 and in order, and for an
// error that no value up to `fullest` has.
ExposureChoice choose_exposures(const RadianceRange& scene, const ChoiceSettings& settings);

// The same with at most `most` exposures: where more are needed the error is larger, by a twentieth
// at a time. Throws also for `most` = 0.
ExposureChoice choose_at_most(std::size_t most,
                              const RadianceRange& scene,
                              const ChoiceSettings& settings);

}  // namespace capture
