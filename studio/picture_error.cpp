// Errors of shown frames.
#include "studio/picture_error.h"

#include <algorithm>

namespace studio {

Truth truth_of(const capture::Image& plate,
               const std::function<capture::Image(std::uint32_t seed)>& reference) {
  Truth truth;
  truth.mask = capture::make_image(plate.height, plate.width, 1);
  for (std::uint32_t i = 0; i < truth.references.size(); ++i) {
    truth.references[i] = reference(i + 1);
    const capture::Image affected = render::affected_mask(truth.references[i], plate);
    std::ranges::transform(truth.mask.pixels, affected.pixels, truth.mask.pixels.begin(),
                           std::ranges::max);
  }
  return truth;
}

Truth truth_of(const ShownFrame& shown, int samples) {
  const capture::Image plate = capture::to_float(*shown.prepared.plate);
  render::ReferenceSettings settings;
  settings.samples = samples / 2;
  return truth_of(plate, [&](std::uint32_t seed) {
    settings.seed = seed;
    return render::render_reference(shown.prepared.inputs(), shown.prepared.job, plate, settings);
  });
}

capture::Image mean_of(const Truth& truth) {
  capture::Image mean = truth.references[0];
  std::ranges::transform(mean.pixels, truth.references[1].pixels, mean.pixels.begin(),
                         [](float a, float b) { return (a + b) / 2; });
  return mean;
}

render::PictureError error_against(const Truth& truth, const ShownFrame& shown) {
  return render::picture_error(capture::to_float(shown.result->rgba), truth.references, truth.mask);
}

}  // namespace studio
