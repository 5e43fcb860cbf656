// Through which lens a clean plate was filmed, and whether that is the lens of its clip.
#include "studio/plate_lens.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "calibrate/lens_distance.h"
#include "capture/exr.h"
#include "compositing/keyer.h"

namespace studio {
namespace {

// Of half the picture's diagonal. Farther out, calibrations of one lens may differ by anything:
// often no board was held there (keying_measured.md).
constexpr double middle_share = 0.55;
// What is less does nothing to a picture, however small.
constexpr double least_px = 1;

double middle_radius_px(const calibrate::Lens& lens) {
  return middle_share * std::hypot(lens.width, lens.height) / 2;
}

// What a file says, for a terminal: no more of it than can be read.
std::string tame(std::string text) {
  constexpr std::size_t enough = 300;
  if (text.size() > enough) text = text.substr(0, enough) + " ...";
  std::ranges::replace_if(
      text, [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

std::vector<calibrate::Vec2> places_in_middle(const calibrate::Lens& lens) {
  constexpr int steps = 48;
  const double radius_px = middle_radius_px(lens);
  std::vector<calibrate::Vec2> places;
  for (int y = 0; y <= steps; ++y) {
    for (int x = 0; x <= steps; ++x) {
      const calibrate::Vec2 q{(lens.width - 1.0) * x / steps, (lens.height - 1.0) * y / steps};
      const double aside = q.x - (lens.width - 1) / 2.0, down = q.y - (lens.height - 1) / 2.0;
      if (std::hypot(aside, down) <= radius_px) places.push_back(q);
    }
  }
  return places;
}

bool is_of_size(const calibrate::Lens& lens, int width, int height) {
  return lens.width == width && lens.height == height;
}

// The lens of the whole picture, of which a part is shown.
calibrate::Lens whole_lens(const calibrate::Lens& lens, const ShownPart& shown) {
  if (!shown.crop || is_of_size(lens, shown.whole_width, shown.whole_height)) return lens;
  const auto [x, y, width, height] = *shown.crop;
  return calibrate::cropped(lens, -x, -y, shown.whole_width, shown.whole_height);
}

}  // namespace

std::string words_for_lens(const calibrate::Lens& lens) {
  const double fx = lens.parameters.at(0);
  const bool one = lens.model == "equisolid";
  const double fy = one ? fx : lens.parameters.at(1);
  // mrcal's names of splines and their knots are long.
  const std::string model = lens.model.substr(0, lens.model.find("_order="));
  if (std::abs(fx - fy) < 5e-4 * fx)
    return fmt::format("a focal length of {:.5g} px ({})", fx, model);
  return fmt::format("focal lengths of {:.5g} and {:.5g} px ({})", fx, fy, model);
}

std::optional<double> apart_px(const calibrate::Lens& plate,
                               const calibrate::Lens& clip,
                               const ShownPart& shown) {
  const calibrate::Lens whole = whole_lens(clip, shown);
  const auto distance =
      calibrate::distance_between(whole_lens(plate, shown), whole, places_in_middle(whole));
  const double most_px =
      std::max(least_px, double{compositing::scale_of_another_lens} * middle_radius_px(whole));
  if (!distance || !(distance->greatest_px > most_px)) return std::nullopt;
  return distance->greatest_px;
}

std::optional<calibrate::Lens> read_plate_lens(const std::string& plate) {
  if (!plate.ends_with(".exr")) return std::nullopt;
  const auto refuse = [&](const std::string& why) {
    throw std::runtime_error(fmt::format(
        "the clean plate {}: take it anew, or note its lens (platelight key plate {} --lens FILE "
        "-o noted.exr)",
        why, plate));
  };
  std::string text;
  try {
    text = capture::read_exr_lens(plate);
  } catch (const std::runtime_error& error) {
    refuse(error.what());
  }
  if (text.empty()) return std::nullopt;
  try {
    return calibrate::lens_from_text(text, "the lens that it notes");
  } catch (const std::runtime_error& error) {
    refuse(plate + ": " + tame(error.what()));
  }
  return std::nullopt;
}

void require_plate_of_lens(const std::string& plate,
                           const calibrate::Lens& clip_lens,
                           const std::string& clip_name,
                           const ShownPart& shown) {
  const auto noted = read_plate_lens(plate);
  if (!noted) return;
  const bool of_whole = shown.crop && is_of_size(*noted, shown.whole_width, shown.whole_height);
  if (!of_whole && !is_of_size(*noted, clip_lens.width, clip_lens.height)) {
    throw std::runtime_error(fmt::format(
        "the clean plate {} notes a lens whose picture is {}x{}, but is {}x{}: note its own "
        "(platelight key plate {} --lens FILE -o noted.exr)",
        plate, noted->width, noted->height, clip_lens.width, clip_lens.height, plate));
  }
  const auto apart = apart_px(*noted, clip_lens, shown);
  if (!apart) return;
  throw std::runtime_error(fmt::format(
      "the clean plate {} was filmed through a lens with {}, but the clip's, {}, has {}: the "
      "same things lie up to {:.4g} px apart in the picture's middle. Film a plate through the "
      "clip's lens (platelight key plate "
      "CAMERA --lens {} -o plate.exr), or, if the plate's note is wrong, note its lens (platelight "
      "key plate {} --lens FILE -o noted.exr)",
      plate, tame(words_for_lens(*noted)), clip_name.empty() ? "as the set has it" : clip_name,
      words_for_lens(clip_lens), *apart, clip_name.empty() ? "FILE" : clip_name, plate));
}

}  // namespace studio
