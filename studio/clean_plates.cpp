// Clean plates, read and made.
#include "studio/clean_plates.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include "capture/crop.h"
#include "capture/exr.h"
#include "compositing/plate_footage.h"

namespace studio {
namespace {

// Of footage without a clean plate, so many frames tell the screen, spread over it.
constexpr int plate_frames = 48;
// Of a pixel in display white, as variance: no camera is noisier, whatever a file says.
constexpr float most_noise = 0.1F;

// Of so many frames from one on, where the camera is.
compositing::PlateFootage spread_frames(capture::Camera& camera, int first, int count) {
  // As many as there are, where that is told: of a short clip each one counts.
  const std::int64_t rest = camera.info().frames - first;
  if (camera.info().frames > 0 && rest > 0) {
    count = static_cast<int>(std::min<std::int64_t>(count, rest));
  }
  const int step = (count + plate_frames - 1) / plate_frames;
  compositing::PlateFootage footage;
  for (int i = 0; i < count; ++i) {
    if (i % step != 0) {
      if (!camera.skip()) break;
      continue;
    }
    const auto frame = camera.next();
    if (!frame) break;
    if (frame->status != capture::FrameStatus::lost && frame->image) footage.add(*frame->image);
  }
  return footage;
}

compositing::CleanPlate read_plate(const std::string& path,
                                   const VideoSource& source,
                                   std::optional<compositing::ScreenColour> colour,
                                   const ShownPart& shown) {
  if (path.ends_with(".exr")) {
    const std::string told = capture::read_exr_transfer(path), wanted = name_of_light(source);
    const auto words_for = [](const std::string& name) {
      return name == capture::by_response ? "by a response" : fmt::format("as \"{}\"", name);
    };
    if (!told.empty() && told != wanted) {
      throw std::runtime_error(fmt::format(
          "the clean plate {} was taken {}, but the video {} is read {}: one of the two "
          "is wrong (colour, response), or the plate is another camera's",
          path, words_for(told), source.uri, words_for(wanted)));
    }
  }
  const bool holds_light = path.ends_with(".exr") || path.ends_with(".hdr");
  if (!source.response.empty() && !holds_light) {
    throw std::runtime_error(
        fmt::format("the clean plate {} holds codes, but the video {} is read by a response: take "
                    "it as light (platelight key plate CAMERA --response {} -o plate.exr)",
                    path, source.uri, source.response));
  }
  const capture::Image picture = read_picture(path, source.colour, shown);
  compositing::CleanPlate plate = compositing::average_plate(std::span(&picture, 1), colour);
  if (!path.ends_with(".exr")) return plate;
  if (const auto noise = capture::read_exr_noise(path)) {
    plate.noise_gain = std::min(noise->gain, most_noise);
    plate.noise_floor = std::clamp(noise->floor, compositing::least_noise_floor, most_noise);
    plate.knows_noise = true;
  }
  return plate;
}

}  // namespace

ShownPart shown_part(const capture::CameraInfo& info, const VideoSource& source) {
  return {info.whole_width, info.whole_height, source.crop};
}

capture::Image read_picture(const std::string& path,
                            capture::Transfer transfer,
                            const ShownPart& shown) {
  const std::string ending = std::filesystem::path(path).extension().string();
  capture::CameraOptions options;
  options.colour.transfer =
      ending == ".exr" || ending == ".hdr" ? capture::Transfer::linear : transfer;
  const auto frame = capture::open_camera("file:" + path, options)->next();
  if (!frame || !frame->image) throw std::runtime_error(path + " holds no picture");
  capture::Image image = *frame->image;
  if (shown.crop && image.width == shown.whole_width && image.height == shown.whole_height) {
    capture::cut(image, capture::crop_within(shown.crop, image.width, image.height));
  }
  return image;
}

std::string needs_plate(const std::string& uri) {
  return uri + " is live and needs a clean plate: platelight key plate CAMERA -o plate.exr";
}

std::optional<std::string> doubts_of_plate(const compositing::CleanPlate& plate,
                                           std::span<const std::uint8_t> garbage,
                                           double much) {
  const double elsewhere = 1 - compositing::screen_share(plate.light, plate.colour, garbage);
  if (elsewhere >= 1) return "the plate has no colour, and is no screen";
  if (!(elsewhere > much)) return std::nullopt;
  return fmt::format(
      "{:.0f} % of the plate is not screen: if somebody is in the picture, take it anew; what else "
      "it is, a garbage mask is to cut away",
      100 * elsewhere);
}

std::string words_for_shift(const compositing::PlateShift& shift) {
  const auto rounded = [](float value, float steps) {
    return std::round(steps * value) / steps + 0.0F;  // none is -0
  };
  std::string words =
      fmt::format("the picture is {:.1f} px further right and {:.1f} px further down",
                  rounded(shift.right_px, 10), rounded(shift.down_px, 10));
  const float degrees = rounded(shift.roll_rad * 180 / std::numbers::pi_v<float>, 10);
  if (std::abs(degrees) > 0.15F) {  // as well as it is known
    words += fmt::format(", turned by {:.1f} degrees {}", std::abs(degrees),
                         degrees > 0 ? "clockwise" : "counter-clockwise");
  }
  const float percent = rounded(100 * (shift.scale - 1), 10);
  if (std::abs(percent) > 0.25F)
    words += fmt::format(", {:.1f} % {}", std::abs(percent), percent > 0 ? "larger" : "smaller");
  return words + " than its clean plate";
}

std::string words_for_scattered() {
  return "much in the picture lies elsewhere than on the clean plate, and not as when a camera "
         "is moved: take the plate anew";
}

std::string words_for_ghost(float share) {
  return fmt::format(
      "{:.1f} % of the picture is screen where the clean plate shows something else, as of "
      "somebody who stood there: it is taken for the person. Take the plate anew, or cut it "
      "away by a garbage mask",
      100 * share);
}

compositing::CleanPlate read_clean_plate(const std::string& path,
                                         const VideoSource& source,
                                         const compositing::KeySettings& settings,
                                         std::array<int, 2> footage,
                                         const ShownPart& shown) {
  if (!path.empty()) return read_plate(path, source, settings.screen_colour, shown);
  VideoSource whole = source;
  whole.first = footage[0];
  whole.loop = false;
  const auto camera = open_video(whole);
  if (camera->info().live) {
    throw std::runtime_error(needs_plate(source.uri));
  }
  const compositing::PlateFootage frames =
      spread_frames(*camera, footage[0], footage[1] - footage[0] + 1);
  if (frames.count() == 0) {
    throw std::runtime_error(source.uri + " has no frame " + std::to_string(footage[0]) +
                             " to take the plate from");
  }
  return settings.method == compositing::KeyMethod::screen ? frames.screen(settings.screen_colour)
                                                           : frames.background();
}

}  // namespace studio
