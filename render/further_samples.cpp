// What the further camera rays of a cell's pixels show, added up.
#include "render/further_samples.h"

#include <algorithm>
#include <cmath>

namespace render {
namespace {

// What counts of a sample's light for how uncertain its pixel is.
Vec3f counted(Vec3f v) {
  return {std::min(v.x, sample_limit), std::min(v.y, sample_limit), std::min(v.z, sample_limit)};
}

}  // namespace

void FurtherSamples::begin(std::size_t pixel) {
  counts_[pixel] = 0;
  of_pixel_[pixel] = {};
}

void FurtherSamples::add(std::size_t pixel, const CameraSample& sample, int times) {
  counts_[pixel] = static_cast<std::uint16_t>(counts_[pixel] + times);
  const auto n = static_cast<float>(times);
  const Vec3f shown = counted(sample.added), behind = sample.plate * plate_contrast;
  Sums& sums = of_pixel_[pixel];
  sums.shown += shown * n;
  sums.behind += behind * n;
  sums.squares += (shown * shown + behind * behind) * n;
}

void FurtherSamples::add_to_batch(std::size_t pixel, int batch, const CameraSample& sample) {
  if (batch_.count > 0 && (batch_.pixel != pixel || batch_.number != batch)) end_batch();
  batch_.pixel = pixel, batch_.number = batch;
  ++batch_.count;
  batch_.shown += counted(sample.added);
  batch_.behind += sample.plate * plate_contrast;
}

void FurtherSamples::end_batch() {
  if (batch_.count == 0) return;
  Sums& sums = of_pixel_[batch_.pixel];
  sums.batch_squares += (batch_.shown * batch_.shown + batch_.behind * batch_.behind) *
                        (1 / static_cast<float>(batch_.count));
  ++sums.batches;
  batch_ = {};
}

// Not less than rounding leaves.
float FurtherSamples::spread(std::size_t pixel, Vec3f squares) const {
  const Vec3f shown = of_pixel_[pixel].shown, behind = of_pixel_[pixel].behind;
  const Vec3f of_mean =
      (shown * shown + behind * behind) * (1 / static_cast<float>(counts_[pixel]));
  return std::max(largest(squares - of_mean), 0.0F);
}

float FurtherSamples::share_shown(std::size_t pixel) const {
  const Sums& sums = of_pixel_[pixel];
  const auto n = static_cast<float>(counts_[pixel]);
  if (!(n > 1)) return 1;
  // A few samples that met a glint have a bright mean, of what may well be dark.
  const float twice_error = 2 * std::sqrt(spread(pixel)) / n;
  const float mean = std::min({sums.shown.x, sums.shown.y, sums.shown.z}) / n;
  const float over = std::max((mean - twice_error) / display_limit, 1.0F);
  return 1 / (over * over * over * over);
}

// Batches that agree may all be off alike: each has a sample in every quarter of the pixel. But
// then what crosses it is an edge, or small, and the mean of n such samples is off as n^(-3/4)
// (Mitchell, "Consequences of Stratified Sampling in Graphics", SIGGRAPH 1996).
float FurtherSamples::variance(std::size_t pixel) const {
  const Sums& sums = of_pixel_[pixel];
  const auto n = static_cast<float>(counts_[pixel]), batches = static_cast<float>(sums.batches);
  if (!(n > 1)) return 0;
  const float alone = spread(pixel, sums.squares) / (n - 1);
  if (batches == n) return alone;
  const float among = batches > 1 ? spread(pixel, sums.batch_squares) / (batches - 1) : 0.0F;
  return std::max(among, alone / std::sqrt(n));
}

}  // namespace render
