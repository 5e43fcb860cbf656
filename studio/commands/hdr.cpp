// platelight hdr: from bracketed shots, or one HDR picture, to an EXR file.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/camera_response.h"
#include "capture/exr.h"
#include "capture/make_hdr.h"
#include "studio/commands/commands.h"
#include "studio/commands/exposure_list.h"
#include "studio/json_text.h"
#include "studio/set_files.h"

namespace studio {
namespace {

struct HdrCommandOptions {
  std::vector<std::string> shots;
  std::string out;
  std::string exposures;
  std::string response = "auto";
  std::string response_out;
};

// Of each shot, in seconds; none if none are stated.
std::vector<double> stated_exposures(const HdrCommandOptions& options) {
  std::vector<double> exposures_s = exposures_in(options.exposures);
  if (!exposures_s.empty() && exposures_s.size() != options.shots.size()) {
    throw UsageError(fmt::format("--exposures states {} times for {} shots", exposures_s.size(),
                                 options.shots.size()));
  }
  if (std::ranges::find(exposures_s, 0) != exposures_s.end()) {
    throw UsageError("--exposures: a dark shot tells nothing of the light");
  }
  return exposures_s;
}

nlohmann::ordered_json to_json(const capture::HdrResult& result, double stops) {
  auto candidates = nlohmann::ordered_json::array();
  for (const capture::ResponseCandidate& c : result.candidates) {
    candidates.push_back(
        {{"name", c.name}, {"parameters", c.parameters}, {"heldout_error", c.heldout_error}});
  }
  return {{"exposures_s", result.exposures_s},
          {"response",
           {{"name", result.response.name},
            {"coefficients", result.response.coefficients},
            {"heldout_error", result.heldout_error ? nlohmann::ordered_json(*result.heldout_error)
                                                   : nlohmann::ordered_json(nullptr)},
            {"candidates", candidates}}},
          {"contradicting", result.shares.contradicting},
          {"saturated", result.shares.saturated},
          {"black", result.shares.black},
          {"warnings", result.warnings},
          {"stops", stops},
          {"time_ms", result.time_ms}};
}

void save_response(const HdrCommandOptions& options, const capture::HdrResult& result) {
  try {
    capture::write_response(options.response_out, {result.response, std::nullopt});
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(
        fmt::format("cannot write {}: {}", options.response_out, error.what()));
  }
}

// Throws if anything that is to be written is what is read.
void spare_shots(const HdrCommandOptions& options, const Console& console) {
  std::vector<ReadFile> files;
  for (const std::string& shot : options.shots) files.push_back({"one of the shots", shot});
  if (options.response.ends_with(".rsp") || options.response.ends_with(".toml")) {
    files.push_back({"the response that the shots are read by", options.response});
  }
  for (const std::string& written : {options.out, options.response_out, console.figures_file()}) {
    spare_files(files, written);
  }
}

void hdr(const HdrCommandOptions& options, Console& console) {
  if (!options.out.ends_with(".exr")) throw UsageError("-o must name an .exr file");
  spare_shots(options, console);
  const capture::HdrResult result =
      capture::make_hdr(options.shots, {stated_exposures(options), options.response});
  if (!options.response_out.empty()) save_response(options, result);
  capture::write_exr(options.out, result.radiance);
  const double stops = capture::range_stops(result.radiance);
  console.figures(json_text(to_json(result, stops)));
  for (const std::string& warning : result.warnings) console.warn(warning);
  console.say(fmt::format("{}: {}x{}, {:.1f} stops from {} files, response {}", options.out,
                          result.radiance.width, result.radiance.height, stops,
                          options.shots.size(), result.response.name));
}

}  // namespace

Command hdr_command() {
  return {"hdr", "Merge bracketed shots to an HDR picture, or convert one",
          "platelight hdr bracket/*.JPG -o light.exr --json light.json",
          [](Arguments& arguments) -> std::function<void(Console&)> {
            auto o = std::make_shared<HdrCommandOptions>();
            arguments.positionals("SHOTS", o->shots, "shots, or one HDR or EXR file");
            arguments.option("-o,--out", o->out, "EXR file");
            arguments.required("--out");
            arguments.option("--exposures", o->exposures,
                             "seconds of each shot, such as 1/80,0.5,13; else as EXIF tells them");
            arguments.option("--response", o->response,
                             "auto (recovered), sRGB, linear, or a .rsp or .toml file");
            arguments.option(
                "--response-out", o->response_out,
                "write the response to this .rsp or .toml file, for sets and other shots");
            return [o](Console& console) { hdr(*o, console); };
          }};
}

}  // namespace studio
