// Errors of shown frames.
#include "studio/picture_error.h"

#include <algorithm>

namespace studio {

Truth truth_of(const ShownFrame& shown, int samples) {
  const capture::Image plate = capture::to_float(*shown.prepared.plate);
  Truth truth;
  truth.mask = capture::make_image(plate.height, plate.width, 1);
  render::ReferenceSettings settings;
  settings.samples = samples / 2;
  for (capture::Image& reference : truth.references) {
    reference =
        render::render_reference(shown.prepared.inputs(), shown.prepared.job, plate, settings);
    const capture::Image affected = render::affected_mask(reference, plate);
    std::ranges::transform(truth.mask.pixels, affected.pixels, truth.mask.pixels.begin(),
                           std::ranges::max);
    ++settings.seed;
  }
  return truth;
}

render::PictureError error_against(const Truth& truth, const ShownFrame& shown) {
  return render::picture_error(capture::to_float(shown.result->rgba), truth.references, truth.mask);
}

}  // namespace studio
