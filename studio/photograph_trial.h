// A made set's composite against its photograph, with parts of it replaced by the truth.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "capture/image.h"
#include "render/paired_error.h"
#include "studio/demo.h"
#include "studio/frame_maker.h"

namespace studio {

// What of a composite is taken from the made world itself, in place of what the program knows.
struct Truths {
  bool plate = false;        // the plate before noise, clipping and coding
  bool light = false;        // the light around the probe, for what was measured of it
  bool calibration = false;  // the camera's pose, for one that is off by the trial's error
  bool matte = false;        // the objects' coverage, and the ground in their shadow behind them
  bool sampling = false;     // endless lights, rays and edge samples, for the kernel's
  bool bounces = false;  // light between surfaces, which the kernel leaves out; needs `sampling`
};

struct TrialSettings {
  int photograph_samples = 64;  // paths per pixel of each truth, for each part of the light
  int reference_samples = 64;   // of each composite without the kernel
};

// How far a composite is from the photograph.
struct TrialResult {
  render::PairedError error;
  double error_p99 = 0;  // unclamped 99th percentile, the photographs' noise included
  double time_ms = 0;    // of the picture, without what it was made from
};

// Frame 0 of a set that write_demo() wrote: the photograph of the same world with the car really
// there, every truth twice, with independent noise.
class PhotographTrial {
 public:
  // Takes the set's first frame, and all photographs. Throws SetError, and std::runtime_error if no
  // truth lies beside the set's plate.
  PhotographTrial(const std::string& set_file,
                  const TrialSettings& settings,
                  const DemoProgress& progress);

  // The composite with some of it true. `calibration_error_px` turns the camera by so much to the
  // right and so much down, unless the calibration is true. Throws std::invalid_argument for
  // bounces without sampling.
  TrialResult measure(const Truths& truths, double calibration_error_px = 0) const;

  // The composite as measure() has it, (height, width, 3), with the first of its two noises.
  capture::Image composite(const Truths& truths, double calibration_error_px = 0) const;
  // The mean of the two photographs.
  const capture::Image& photograph() const { return photograph_; }
  // Where anything virtual changes the picture (render::affected_mask).
  const capture::Image& mask() const { return mask_; }
  double affected_share() const;
  std::size_t triangles() const;

 private:
  struct Twice {
    capture::Image first, second;
  };
  // RGB and coverage of the car, (height, width, 4), over a plate.
  capture::Image render(const Truths& truths,
                        double calibration_error_px,
                        const capture::Image& plate,
                        std::uint32_t seed) const;
  capture::Image compose(const Truths& truths, double calibration_error_px, bool first) const;

  TrialSettings settings_;
  PreparedFrame frame_;
  capture::Image plate_;            // as the program has it
  render::Environment true_light_;  // at the probe
  render::LightTable true_table_;
  Twice photographs_, plates_, behind_;
  capture::Image coverage_;  // of what is virtual
  capture::Image photograph_, mask_;
};

// What each step takes away of an error's square, as shares of the square before all steps: from
// the squares before, and after each step. The shares and what is left over add up to 1; one that
// is below 0 uncovers an error that had hidden another. Throws std::invalid_argument unless the
// first square is above 0.
std::vector<double> parts_of_square(const std::vector<double>& squares);

}  // namespace studio
