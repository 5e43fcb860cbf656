// Errors of shown frames.
#include "studio/picture_error.h"

#include <cstddef>

namespace studio {
namespace {

// The first three of four channels.
capture::Image colour_of(const capture::Image& rgba) {
  capture::Image colour = capture::make_image(rgba.height, rgba.width, 3);
  for (std::size_t i = 0; i < colour.pixels.size(); ++i) {
    colour.pixels[i] = rgba.pixels[i / 3 * 4 + i % 3];
  }
  return colour;
}

}  // namespace

Truth truth_of(const ShownFrame& shown, int samples) {
  const capture::Image plate = capture::to_float(*shown.prepared.plate);
  render::ReferenceSettings settings;
  settings.samples = samples;
  const capture::Image reference =
      render::render_reference(shown.prepared.inputs(), shown.prepared.job, plate, settings);
  Truth truth{colour_of(reference), capture::make_image(reference.height, reference.width, 1)};
  for (std::size_t i = 0; i < truth.mask.pixels.size(); ++i) {
    bool affected = reference.pixels[i * 4 + 3] > 0;
    for (std::size_t c = 0; c < 3; ++c) {
      affected = affected || truth.picture.pixels[i * 3 + c] != plate.pixels[i * 3 + c];
    }
    truth.mask.pixels[i] = affected ? 1.0F : 0.0F;
  }
  return truth;
}

render::PictureError error_against(const Truth& truth, const ShownFrame& shown) {
  return render::picture_error(colour_of(capture::to_float(shown.result->rgba)), truth.picture,
                               truth.mask);
}

}  // namespace studio
