// From bracketed shots to scene-linear radiance.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "capture/image.h"
#include "capture/response.h"

namespace capture {

// One shot of a bracket, dark level removed and response made linear.
struct Shot {
  Image linear;           // (height, width, channels), 0 = black, 1 = saturated
  double exposure_s = 0;  // > 0
};

// The variance of one sample of value v (1 = saturated): read + shot * v + relative^2 * v^2.
struct NoiseModel {
  double read = 1e-6;        // electronics and rounding
  double shot = 4e-5;        // photons: 1 / the electrons at saturation
  double relative = 0;       // what scales with the value: an inexact response or exposure
  double saturation = 0.98;  // values from here on are lower bounds only

  double variance(double value) const;
};

// Merges shots of a still scene into one radiance image.
//
// Takes one or more shots of one size and channel count, in any order. Returns the same size in
// sensor units per second. A value saturated in every shot comes from the shortest one, and is a
// lower bound. Values that are not finite count as not taken; where no shot has one, the result is
// 0. `deviation`, if given, receives the standard deviation of each value by the noise model:
// infinite where the value is a lower bound or missing.
// Throws std::invalid_argument if there are no shots, or sizes differ, or an exposure is not > 0.
//
// Debevec and Malik, "Recovering High Dynamic Range Radiance Maps from Photographs", SIGGRAPH 1997,
// section 2.2, with the inverse variances of Granados, Ajdin, Wand, Theobalt, Seidel and Lensch,
// "Optimal HDR Reconstruction with Linear Digital Cameras", CVPR 2010, as weights: they are taken
// at the common estimate, not at each sample's own noisy value, which would favour low ones. We
// average radiance, not its logarithm, so that noise near black stays unbiased.
Image merge_shots(std::span<const Shot> shots,
                  const NoiseModel& noise = {},
                  Image* deviation = nullptr);

// What each of the 256 codes of a channel means: its linear value, and the variance of that value;
// infinite for saturated codes.
struct CodeTable {
  std::vector<double> value;
  std::vector<double> variance;
};

// 8-bit codes through a response, each uncertain by `code_sigma` codes.
CodeTable response_code_table(const Response& response, int channel, double code_sigma = 1);

// Merges shots of 8-bit codes through tables: response, exposure, weight and saturation of a code
// are looked up at once. Weights are those of each sample's own value, so merge_shots is the more
// accurate one in deep shadow; this one is the faster.
class MergeTables {
 public:
  // Room for `shots` exposures of three channels. Throws std::invalid_argument for no shots, tables
  // of another size than 256, variances that are not above 0, or no unsaturated code.
  MergeTables(std::array<CodeTable, 3> channels, int shots);

  // The exposures of the shots that follow. Allocates nothing. Throws std::invalid_argument unless
  // there are as many as shots, each above 0.
  void set_exposures(std::span<const double> exposures_s);

  // Merges the rows first_row..last_row - 1 of interleaved RGB codes, each shot (height, width, 3)
  // without gaps between rows, into `radiance` of the same layout (sensor units per second).
  // Allocates nothing; different rows may be merged by different threads at once. Throws
  // std::invalid_argument if the shots are not as many as tables.
  void merge(std::span<const std::uint8_t* const> shots,
             int width,
             int first_row,
             int last_row,
             float* radiance) const;

 private:
  // What one code adds to the weighted sum and to the sum of weights.
  struct Entry {
    float weighted = 0;
    float weight = 0;
  };

  std::array<CodeTable, 3> channels_;
  std::size_t shots_ = 0;
  std::vector<Entry> entries_;  // (shots, 3, 256)
};

}  // namespace capture
