// platelight calibrate response: how a camera's codes follow light, and their noise.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "capture/calibration_shots.h"
#include "capture/camera_response.h"
#include "capture/photon_transfer.h"
#include "capture/response.h"
#include "studio/commands/commands.h"
#include "studio/commands/exposure_list.h"
#include "studio/json_text.h"
#include "studio/set_files.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

struct ResponseOptions {
  std::vector<std::string> shots;
  std::string out;
  std::string model = "auto";
  std::string exposures;
  std::string mosaic;
  std::string compare;
};

// What was found, in the words of files, figures and people.
struct Calibrated {
  capture::CameraResponse response;
  std::optional<capture::PhotonTransfer> transfer;
  std::optional<capture::ResponseFit> fit;
  std::vector<std::string> warnings;
};

capture::BayerPattern pattern_of(const std::string& name) {
  using capture::BayerPattern;
  if (name.empty()) return BayerPattern::none;
  if (name == "rggb") return BayerPattern::rggb;
  if (name == "grbg") return BayerPattern::grbg;
  if (name == "gbrg") return BayerPattern::gbrg;
  if (name == "bggr") return BayerPattern::bggr;
  throw UsageError(fmt::format("--mosaic is rggb, grbg, gbrg or bggr, not \"{}\"", name));
}

Calibrated calibrate_linear(const capture::CalibrationShots& shots) {
  Calibrated found;
  found.transfer = capture::measure_photon_transfer(shots.sensor_shots(), shots.bits);
  found.response = capture::response_of(*found.transfer, shots.full_code);
  found.warnings = found.transfer->warnings;
  return found;
}

Calibrated calibrate_curve(const capture::CalibrationShots& shots) {
  if (shots.pattern != capture::BayerPattern::none) {
    throw std::runtime_error(
        "a curve is not recovered from a mosaic: give pictures in colour, or shots of a linear "
        "sensor, each exposure twice");
  }
  Calibrated found;
  const std::vector<capture::CodedShot> coded = shots.coded_shots();
  if (coded.size() < 3) {
    throw std::runtime_error(fmt::format(
        "a response curve needs shots of three exposures or more; these have {}", coded.size()));
  }
  found.fit = capture::recover_response(coded);
  found.response.curve = found.fit->response;
  found.warnings = found.fit->warnings;
  if (found.fit->response.name == "linear") {
    found.warnings.push_back(
        "the camera is linear: with each exposure taken twice, as PNG or a recording, its noise "
        "and black level would be told too");
  }
  return found;
}

bool has_repeats(const capture::CalibrationShots& shots) {
  std::vector<double> sorted = shots.exposures_s;
  std::sort(sorted.begin(), sorted.end());
  return std::adjacent_find(sorted.begin(), sorted.end(),
                            [](double a, double b) { return b <= a * (1 + 1e-3); }) != sorted.end();
}

// A linear sensor if the shots show one; else the simplest curve that suffices.
Calibrated calibrate(const capture::CalibrationShots& shots, const std::string& model) {
  if (model == "linear") return calibrate_linear(shots);
  if (model == "curve" || shots.compressed || !has_repeats(shots)) return calibrate_curve(shots);
  try {
    return calibrate_linear(shots);
  } catch (const capture::NotLinear& reason) {
    try {
      return calibrate_curve(shots);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("{}; and: {}", reason.what(), error.what()));
    }
  }
}

Json estimates_json(const capture::PhotonTransfer& transfer,
                    capture::Estimate capture::ChannelTransfer::*which) {
  Json values = Json::array();
  for (const capture::ChannelTransfer& channel : transfer.channels) {
    values.push_back({{"value", (channel.*which).value}, {"sigma", (channel.*which).sigma}});
  }
  return values;
}

Json linear_json(const capture::PhotonTransfer& transfer) {
  using capture::ChannelTransfer;
  Json saturation = Json::array();
  Json linearity = Json::array();
  for (const ChannelTransfer& channel : transfer.channels) {
    saturation.push_back(
        {{"value", channel.saturation}, {"usable", channel.usable}, {"seen", channel.saturated}});
    linearity.push_back(channel.linearity_error);  // NaN becomes null
  }
  const capture::NoiseModel noise = transfer.noise();
  return {{"gain", estimates_json(transfer, &ChannelTransfer::gain)},
          {"black", estimates_json(transfer, &ChannelTransfer::black)},
          {"read_noise", estimates_json(transfer, &ChannelTransfer::read_noise)},
          {"read_noise_e", estimates_json(transfer, &ChannelTransfer::read_noise_e)},
          {"saturation", saturation},
          {"linearity_error", linearity},
          {"noise", {{"read", noise.read}, {"shot", noise.shot}, {"saturation", noise.saturation}}},
          {"exposures_s", transfer.exposures_s}};
}

Json curve_json(const capture::ResponseFit& fit) {
  Json candidates = Json::array();
  for (const capture::ResponseCandidate& c : fit.candidates) {
    candidates.push_back({{"name", c.name},
                          {"parameters", c.parameters},
                          {"heldout_error", c.heldout_error},
                          {"pixel_error", c.pixel_error}});
  }
  return {{"heldout_error", fit.heldout_error},
          {"pixel_error", fit.pixel_error},
          {"changed", fit.changed},
          {"candidates", candidates},
          {"coefficients", fit.response.coefficients},
          {"exposures_s", fit.exposures_s}};
}

// How far another response is from the one found: relative, codes 25 to 235, light of code 128
// alike.
double difference_to(const capture::Response& other, const capture::Response& found) {
  double worst = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double scale = found.light[c][128] / other.light[c][128];
    for (std::size_t z = 25; z <= 235; ++z) {
      worst = std::max(worst, std::abs(other.light[c][z] * scale / found.light[c][z] - 1));
    }
  }
  return worst;
}

void compare(const ResponseOptions& options,
             const capture::Response& other,
             const capture::CalibrationShots& shots,
             const Calibrated& found,
             Json& figures,
             Console& console) {
  const capture::ResponseCheck check = capture::check_response(other, shots.coded_shots());
  const double difference = difference_to(other, found.response.curve);
  figures["compared"] = {{"file", options.compare},
                         {"heldout_error", check.error},
                         {"pixel_error", check.pixel_error},
                         {"largest_difference", difference}};
  console.say(
      fmt::format("{}: held-out error {:.2f} %, by pixel {:.2f} %; differs by up to {:.1f} %",
                  options.compare, 100 * check.error, 100 * check.pixel_error, 100 * difference));
}

void say_linear(const capture::PhotonTransfer& transfer, Console& console) {
  constexpr std::array names{"red", "green", "blue"};
  for (std::size_t c = 0; c < transfer.channels.size(); ++c) {
    const capture::ChannelTransfer& channel = transfer.channels[c];
    console.say(
        fmt::format("{}: gain {:.4g} +- {:.2g} electrons per code, black {:.2f} +- {:.2g}, read "
                    "noise {:.2f} +- "
                    "{:.2g} electrons, saturation {:.0f}",
                    transfer.channels.size() == 1 ? "grey" : names[c], channel.gain.value,
                    channel.gain.sigma, channel.black.value, channel.black.sigma,
                    channel.read_noise_e.value, channel.read_noise_e.sigma, channel.saturation));
  }
}

void say_curve(const capture::ResponseFit& fit, Console& console) {
  console.say("candidate                 parameters  held-out error  by pixel");
  for (const capture::ResponseCandidate& c : fit.candidates) {
    console.say(fmt::format("{:<25} {:>10} {:>13.2f} % {:>7.2f} %", c.name, c.parameters,
                            100 * c.heldout_error, 100 * c.pixel_error));
  }
}

void calibrate_response(const ResponseOptions& options, Console& console) {
  if (!options.out.ends_with(".toml") && !options.out.ends_with(".rsp")) {
    throw UsageError("-o must name a .toml or a .rsp file");
  }
  if (options.model != "auto" && options.model != "linear" && options.model != "curve") {
    throw UsageError("--model is auto, linear or curve");
  }
  std::vector<ReadFile> read{{"the response to compare with", options.compare}};
  for (const std::string& shot : options.shots) read.push_back({"one of the shots", shot});
  for (const std::string& written : {options.out, console.figures_file()})
    spare_files(read, written);
  std::optional<capture::Response> other;
  if (!options.compare.empty()) other = capture::read_response(options.compare).curve;
  capture::CalibrationShotOptions reading;
  reading.exposures_s = exposures_in(options.exposures);
  reading.pattern = pattern_of(options.mosaic);
  const auto start = std::chrono::steady_clock::now();
  capture::CalibrationShots shots;
  try {
    shots = capture::read_calibration_shots(options.shots, reading);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
  Calibrated found = calibrate(shots, options.model);
  found.warnings.insert(found.warnings.begin(), shots.warnings.begin(), shots.warnings.end());
  const double time_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  try {
    capture::write_response(options.out, found.response);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(error.what());
  }
  Json figures{{"model", found.response.curve.name},
               {"parameters", found.fit ? 0 : 4 * found.transfer->channels.size()}};
  if (found.fit) {
    const auto chosen = std::find_if(
        found.fit->candidates.begin(), found.fit->candidates.end(),
        [&](const capture::ResponseCandidate& c) { return c.name == found.fit->response.name; });
    if (chosen != found.fit->candidates.end()) figures["parameters"] = chosen->parameters;
  }
  figures.update(found.fit ? curve_json(*found.fit) : linear_json(*found.transfer));
  if (found.transfer) say_linear(*found.transfer, console);
  if (found.fit) say_curve(*found.fit, console);
  if (other) compare(options, *other, shots, found, figures, console);
  figures["warnings"] = found.warnings;
  figures["time_ms"] = time_ms;
  console.figures(json_text(figures));
  for (const std::string& warning : found.warnings) console.warn(warning);
  console.say(fmt::format("{}: {} from {} shots", options.out, found.response.curve.name,
                          shots.codes.size()));
}

}  // namespace

Command calibrate_response_command() {
  return {"calibrate response", "Measure how a camera's codes follow light, and their noise",
          "platelight calibrate response bracket/*.JPG -o camera.rsp --json response.json",
          [](Arguments& arguments) -> std::function<void(Console&)> {
            auto o = std::make_shared<ResponseOptions>();
            arguments.positionals("SHOTS", o->shots,
                                  "shots of a scene that stands still, or replay:DIR");
            arguments.option("-o,--out", o->out,
                             ".toml file, or .rsp for polynomials: a set's response");
            arguments.required("--out");
            arguments.option("--model", o->model, "auto, linear (photon transfer) or curve");
            arguments.option("--exposures", o->exposures,
                             "seconds of each shot, such as 1/80,0.5,13; 0 = a dark shot");
            arguments.option("--mosaic", o->mosaic,
                             "rggb, grbg, gbrg or bggr: the shots are a Bayer sensor's");
            arguments.option("--compare", o->compare, "also judge this .rsp or .toml file");
            return [o](Console& console) { calibrate_response(*o, console); };
          },
          "Measure cameras: how they see, where they stand, how they follow light"};
}

}  // namespace studio
