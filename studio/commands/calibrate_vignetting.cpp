// platelight calibrate vignetting: how a lens dims towards its rim.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/angles.h"
#include "calibrate/pose_file.h"
#include "calibrate/vignetting_fit.h"
#include "capture/camera.h"
#include "studio/commands/commands.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

using calibrate::degree;
// Of pictures of codes, where 1 is saturated. Brighter values are of HDR pictures.
constexpr double saturation_of_codes = 0.98;

struct VignettingOptions {
  std::vector<std::string> shots;
  std::string lens;
  std::string poses;
  std::string response;
};

struct Shot {
  std::shared_ptr<const capture::Image> radiance;
  double saturation = 0;
};

// Throws if so much of a shot is saturated or black that the rest tells nothing.
void require_exposed(const std::string& source, const Shot& shot) {
  constexpr double much_saturated = 0.4, nearly_all = 0.9;  // a fish-eye's rim is black
  std::size_t saturated = 0, black = 0;
  for (const float value : shot.radiance->pixels) {
    saturated += static_cast<double>(value) >= shot.saturation ? 1 : 0;
    black += value > 0 ? 0 : 1;
  }
  const auto all = static_cast<double>(shot.radiance->pixels.size());
  const auto refuse = [&](std::size_t count, const char* what) {
    throw std::runtime_error(fmt::format("{}: {:.0f} % of it is {} exposure", source,
                                         100.0 * static_cast<double>(count) / all, what));
  };
  if (static_cast<double>(saturated) > much_saturated * all) {
    refuse(saturated, "saturated; take a shorter");
  }
  if (static_cast<double>(black) > nearly_all * all) refuse(black, "black; take a longer");
}

// The first frame of a picture, video or camera.
Shot read_shot(const std::string& source, const VignettingOptions& options) {
  capture::CameraOptions reading;
  reading.response = options.response;
  const auto camera = capture::open_camera(source, reading);
  const std::optional<capture::Frame> frame = camera->next();
  if (!frame || frame->image == nullptr) throw std::runtime_error(source + ": has no picture");
  bool codes = true;
  for (const float value : frame->image->pixels) codes &= !(value > 1);
  const Shot shot{frame->image, codes ? saturation_of_codes : HUGE_VAL};
  require_exposed(source, shot);
  return shot;
}

std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> words;
  for (std::size_t begin = 0; begin < list.size();) {
    const std::size_t end = std::min(list.find(',', begin), list.size());
    words.push_back(list.substr(begin, end - begin));
    begin = end + 1;
  }
  return words;
}

// A scene in several orientations if there are poses, else an even field each.
std::vector<calibrate::VignettingSample> samples_of(const VignettingOptions& options,
                                                    const calibrate::Lens& lens) {
  std::vector<Shot> shots;
  for (const std::string& source : options.shots) {
    shots.push_back(read_shot(source, options));
    const capture::Image& image = *shots.back().radiance;
    if (image.width != lens.width || image.height != lens.height) {
      throw std::runtime_error(fmt::format("{}: is {}x{}, but {} is of {}x{}", source, image.width,
                                           image.height, options.lens, lens.width, lens.height));
    }
  }
  if (!options.poses.empty()) {
    const std::vector<std::string> poses = split(options.poses);
    if (poses.size() != shots.size() || poses.size() < 2) {
      throw UsageError(
          fmt::format("--poses needs a file for each of two shots or more; there are {} for {}",
                      poses.size(), shots.size()));
    }
    std::vector<calibrate::TurnedShot> turned;
    double saturation = HUGE_VAL;
    for (std::size_t i = 0; i < shots.size(); ++i) {
      turned.push_back({shots[i].radiance.get(), calibrate::read_pose(poses[i])});
      saturation = std::min(saturation, shots[i].saturation);
    }
    return calibrate::turned_samples(turned, lens, saturation);
  }
  std::vector<calibrate::VignettingSample> samples;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    auto field = calibrate::even_field_samples(*shots[i].radiance, lens, shots[i].saturation);
    for (calibrate::VignettingSample& sample : field) sample.place = i;
    samples.insert(samples.end(), field.begin(), field.end());
  }
  return samples;
}

void calibrate_vignetting(const VignettingOptions& options, Console& console) {
  const calibrate::Lens lens = calibrate::read_lens(options.lens);
  const std::vector<calibrate::VignettingSample> samples = samples_of(options, lens);
  const calibrate::VignettingFit fit = [&] {
    try {
      return calibrate::fit_vignetting(samples);
    } catch (const std::invalid_argument& error) {
      throw std::runtime_error(error.what());
    }
  }();
  Json candidates = Json::array();
  console.say("terms  held-out error");
  for (const calibrate::VignettingCandidate& c : fit.candidates) {
    console.say(fmt::format("{:>5} {:>13.2f} %", c.terms, 100 * c.heldout_error));
    candidates.push_back({{"terms", c.terms}, {"heldout_error", c.heldout_error}});
  }
  const double seen_deg = fit.max_angle_rad / degree;
  const bool told = !fit.terms.empty() || fit.warnings.empty();
  console.figures(Json{
      {"vignetting", told ? Json(fit.terms) : Json(nullptr)},
      {"heldout_error", fit.heldout_error},
      {"seen_deg", seen_deg},
      {"samples", samples.size()},
      {"candidates", candidates},
      {"warnings",
       fit.warnings}}.dump(2));
  if (!told) {
    std::string why;
    for (const std::string& warning : fit.warnings) why += (why.empty() ? "" : "; ") + warning;
    throw std::runtime_error("vignetting is not told: " + why);
  }
  for (const std::string& warning : fit.warnings) console.warn(warning);
  if (fit.max_angle_rad < 0.95 * lens.max_angle_rad) {
    console.warn(fmt::format("no light was seen beyond {:.0f} degrees: there the terms are a guess",
                             seen_deg));
  }
  if (fit.terms.empty()) {
    console.say("even: a set needs no vignetting for it");
  } else {
    std::string terms;
    for (const double term : fit.terms) {
      terms += fmt::format("{}{:.4f}", terms.empty() ? "" : ", ", term);
    }
    console.say(fmt::format("vignetting = [{}]", terms));
  }
}

}  // namespace

Command calibrate_vignetting_command() {
  return {"calibrate vignetting", "Measure how a lens dims towards its rim",
          "platelight calibrate vignetting even.exr --lens fisheye.toml --json vignetting.json",
          [](Arguments& arguments) -> std::function<void(Console&)> {
            auto o = std::make_shared<VignettingOptions>();
            arguments.positionals("SHOTS", o->shots,
                                  "pictures of even fields; or of one scene, the camera turned");
            arguments.option("--lens", o->lens, "the lens: a .toml or .cameramodel file");
            arguments.required("--lens");
            arguments.option(
                "--poses", o->poses,
                ".toml or .cameramodel files with the pose of each shot, joined by commas");
            arguments.option("--response", o->response,
                             ".rsp or .toml file of calibrate response, for pictures of codes");
            return [o](Console& console) { calibrate_vignetting(*o, console); };
          }};
}

}  // namespace studio
