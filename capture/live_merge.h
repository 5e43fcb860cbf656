// The merge of a live bracket: radiance, deviation and status from a sliding window of shots.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "capture/hdr.h"
#include "capture/image.h"

namespace capture {

// What a merged pixel is worth: the worst of its channels.
enum class MergeStatus : std::uint8_t {
  good,
  dark,          // within two deviations of black: two deviations above it is an upper bound
  inconsistent,  // older shots show another radiance, and are left out
  lower_bound,   // saturated in every shot that counts; the deviation of such a channel is infinite
  missing,       // no shot has a value: radiance 0, deviation infinite
};
inline constexpr std::size_t merge_status_count = 5;

struct WindowMergeSettings {
  NoiseModel noise;  // of linear values, 1 = saturated; reading includes the rounding to codes
  // Deviations by which a shot may depart from the newer ones before it is left out; 0 = takes
  // every shot: for scenes that stand still.
  double consistency = 4.5;
  // Relative errors of exposure and linearity between shots, which are no sign of motion.
  double exposure_error = 0.01;
  // Merges shots as if all had the window's mean light: for lamps that flicker with the mains,
  // before exposures shorter than their period. Where light changes for good, or labels are wrong,
  // the mean of the window is shown. For global shutters: a rolling one has a gain for every row.
  bool level_flicker = false;
  // The largest ratio of two shots' light that is levelled: beyond it, light has changed.
  double most_levelled = 8;
  // Uses AVX-512 where the machine has it. The same bits without.
  bool widest_registers = true;
};

// A shot whose picture is someone else's.
struct LiveShot {
  const Image* linear = nullptr;  // as Shot::linear, three channels
  double exposure_s = 0;          // > 0
};

// One shot of a linear camera's codes: (height, width, 3), interleaved.
// Charts and tests have them; a show merges floats (hdr.md).
struct CodedShot8 {
  std::span<const std::uint8_t> codes;
  double exposure_s = 0;
};
struct CodedShot16 {
  std::span<const std::uint16_t> codes;
  double exposure_s = 0;
};

// How codes tell light, per channel: black has value 0, white has value 1.
struct LinearCodes {
  int width = 0;
  int height = 0;
  std::array<double, 3> black{0, 0, 0};
  std::array<double, 3> white{255, 255, 255};
};

inline constexpr std::size_t most_window_shots = 16;

// One merged frame, and what it was merged from. Reused from frame to frame, it costs no memory.
struct MergedFrame {
  Image radiance;                      // (height, width, 3), sensor units per second
  std::vector<MergeStatus> status;     // (height, width)
  std::vector<std::uint16_t> counted;  // (height, width, 3): bit i = the window's shot i counts
  NoiseModel noise;
  std::size_t shots = 0;                                // of the window
  std::array<double, most_window_shots> exposures_s{};  // of its shots, as they were merged
  // The light that each shot tells, over the mean: 1 where shots agree within their noise, or
  // cannot be compared. Wrong labels, light that drifts and flicker show here.
  std::array<double, most_window_shots> gains{};
  bool levelled = false;      // the gains were taken out
  double exposure_error = 0;  // as in the settings

  // Fills (height, width, 3): the standard deviation of the radiance, infinite where no shot
  // counts. It is that of the noise model, and beside it how far by their gains the average is from
  // what one of the shots tells. It follows from what counts, so that a merge need not write it.
  void fill_deviation(Image& deviation) const;
  Image deviation() const;

  // The share of pixels with each status. Takes time: for statistics.
  std::array<double, merge_status_count> status_shares() const;
};

// Merges the newest shots of a bracket, the newest last, so that every shot of a camera closes one:
// 1 to 16 shots of one size. Fills `frame`, and allocates nothing if it had this size; uses all of
// oneTBB's threads. The same shots give the same bits, whatever the threads.
//
// Where all shots of a pixel agree within the noise, all are averaged. Where they contradict each
// other something moved, or a lamp changed: then shots are averaged from the newest to the oldest,
// without those that differ from the newer ones in some channel, or lie below what a newer
// saturated one says at least. Values from noise.saturation on, values below -1 and values that are
// not finite do not count. A channel without a value that counts has the highest bound of its
// saturated shots.
//
// A shot of exposure t weighs t^1.5, whatever its value: where reading is the noise, t^2 would be
// the best, and where photons are, t; t^1.5 has at most 8 % more deviation than either with five
// exposures of any kind (5 % for a geometric row). Weights that noise has no part in leave the
// average unbiased, and need no division. Against Granados et al. (hdr.h), whose weights are the
// best ones at each value.
//
// Throws std::invalid_argument for no shots or too many, sizes that differ or are not three
// channels, an exposure outside 1 ns to 10^6 s, whites that are not above their blacks, a noise
// model without noise at black, or settings below 0.
void merge_window(std::span<const LiveShot> shots,
                  const WindowMergeSettings& settings,
                  MergedFrame& frame);
void merge_window(std::span<const CodedShot8> shots,
                  const LinearCodes& codes,
                  const WindowMergeSettings& settings,
                  MergedFrame& frame);
void merge_window(std::span<const CodedShot16> shots,
                  const LinearCodes& codes,
                  const WindowMergeSettings& settings,
                  MergedFrame& frame);

}  // namespace capture
