// Errors of shown frames.
#include "studio/picture_error.h"

#include <cstddef>

namespace studio {

render::PictureError error_of(const ShownFrame& shown, int samples) {
  const capture::Image plate = capture::to_float(*shown.prepared.plate);
  render::ReferenceSettings settings;
  settings.samples = samples;
  const capture::Image reference =
      render::render_reference(shown.prepared.inputs(), shown.prepared.job, plate, settings);
  const capture::Image rgba = capture::to_float(shown.result->rgba);
  capture::Image picture = capture::make_image(rgba.height, rgba.width, 3);
  capture::Image truth = capture::make_image(rgba.height, rgba.width, 3);
  capture::Image mask = capture::make_image(rgba.height, rgba.width, 1);
  for (std::size_t i = 0; i < mask.pixels.size(); ++i) {
    bool affected = reference.pixels[i * 4 + 3] > 0;
    for (std::size_t c = 0; c < 3; ++c) {
      picture.pixels[i * 3 + c] = rgba.pixels[i * 4 + c];
      truth.pixels[i * 3 + c] = reference.pixels[i * 4 + c];
      affected = affected || truth.pixels[i * 3 + c] != plate.pixels[i * 3 + c];
    }
    mask.pixels[i] = affected ? 1.0F : 0.0F;
  }
  return render::picture_error(picture, truth, mask);
}

}  // namespace studio
