// platelight calibrate light: the gain from a set's lightprobe to its plate.
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/light_gain.h"
#include "capture/median.h"
#include "render/match.h"
#include "studio/commands/commands.h"
#include "studio/exposure_follower.h"
#include "studio/frame_maker.h"
#include "studio/json_text.h"
#include "studio/light_pairs.h"
#include "studio/section.h"
#include "studio/set_sections.h"
#include "studio/toml_file.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;
using Colour = std::array<double, 3>;

constexpr std::int64_t default_frames = 25;
// Frames whose exposures differ by this factor come from a camera that sets its own.
constexpr double follows_from = 1.03;
// By what factor a card's gain may differ from that of things far away; a probe that is tilted by
// thirty degrees has twice that.
constexpr double most_off_overlap = 1.6;

struct LightOptions {
  std::string set;
  std::string patches;
  std::optional<std::int64_t> frames;
};

// A grey card, or a patch of a chart, in the plate.
struct PaintedPatch {
  std::string where;  // it is described: file and line
  render::Patch place;
  std::array<float, 3> albedo{};
  calibrate::Vec3 normal{0, 0, 1};
};

std::vector<PaintedPatch> read_patches(const std::string& path, std::array<int, 2> picture) {
  Faults faults(path);
  const TomlValue file = read_toml_file(path);
  Section root(file, "", faults);
  root.need("patch", "the tables of what is painted: [[patch]] with pixels and albedo");
  std::vector<PaintedPatch> patches;
  for (Section& table : root.tables("patch")) {
    PaintedPatch patch;
    patch.where = fmt::format("{}:{}", path, table.place_of("pixels").line);
    std::optional<std::array<int, 4>> pixels;
    table.need("pixels", "[x, y, width, height] in the plate");
    read_rectangle(table, "pixels", picture, pixels);
    if (pixels) patch.place = {(*pixels)[0], (*pixels)[1], (*pixels)[2], (*pixels)[3]};
    table.need("albedo", "what it reflects, 0 to 1, one number or three");
    table.colour("albedo", patch.albedo, {1e-3, 1});
    if (table.vector("normal", patch.normal) && !(length(patch.normal) > 0)) {
      table.fault("normal", "must not be zero");
    }
    table.finish();
    patches.push_back(patch);
  }
  root.finish();
  if (const auto sorted = faults.sorted(); !sorted.empty()) throw SetError(sorted);
  return patches;
}

// The plate as a lens without vignetting would have taken it.
capture::Image even_plate(const PreparedFrame& frame) {
  capture::Image plate = to_float(*frame.plate);
  const calibrate::DirectionTable& directions = *frame.directions;
  if (directions.sensitivity.empty()) return plate;
  for (int y = 0; y < plate.height; ++y) {
    for (int x = 0; x < plate.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        plate.at(y, x, c) /= directions.sensitivity[directions.index(y, x)];
      }
    }
  }
  return plate;
}

// What each patch sends by the probe's light, and what the plate shows of it. One that is clipped,
// dark or unlit tells nothing.
void add_patches(const std::vector<PaintedPatch>& patches,
                 const capture::Image& plate,
                 const render::Environment& env,
                 std::size_t frame,
                 std::vector<calibrate::LightPair>& pairs,
                 std::string& doubt) {
  for (std::size_t p = 0; p < patches.size(); ++p) {
    const PaintedPatch& patch = patches[p];
    const auto split =
        render::split_irradiance_of(env, calibrate::to_float(normalize(patch.normal)));
    if (doubt.empty()) doubt = render::doubt_of_patch(split.seen_share);
    const render::Vec3f light = split.seen + split.filled;
    const auto match = render::match_by_patch(plate, patch.place, patch.albedo, light);
    if (match.pixels == 0) continue;
    const Colour irradiance{light.x, light.y, light.z};
    Colour sent{};
    Colour shown{};
    for (std::size_t c = 0; c < 3; ++c) {
      sent[c] = patch.albedo[c] * irradiance[c] / std::numbers::pi;
      shown[c] = sent[c] * match.gain[c];
    }
    add_light_pair({sent, shown, frame, p}, pairs);
  }
}

void add_overlap(const PreparedFrame& prepared,
                 const capture::Image& plate,
                 std::size_t frame,
                 std::vector<calibrate::LightPair>& pairs) {
  const auto overlap = render::find_overlap(plate, *prepared.directions, prepared.job.cam_from_set,
                                            *prepared.environment);
  std::ranges::copy(light_pairs_of(overlap, frame), std::back_inserter(pairs));
}

// Of which no frame tells anything.
std::vector<std::string> untold_patches(const std::vector<PaintedPatch>& patches,
                                        std::span<const calibrate::LightPair> pairs) {
  std::vector<std::string> untold;
  for (std::size_t p = 0; p < patches.size(); ++p) {
    if (std::ranges::find(pairs, p, &calibrate::LightPair::thing) != pairs.end()) continue;
    untold.push_back(patches[p].where +
                     ": this patch is left out: it is clipped, dark or unlit in every frame");
  }
  return untold;
}

// What the frames tell.
struct Collected {
  std::vector<calibrate::LightPair> pairs;
  std::vector<calibrate::LightPair> overlap;  // beside patches: what both cameras see
  double exposure_s = 0;  // of the plate's first frame that tells anything; 0 = not told
  std::string doubt;      // about the light on patches, "" = none
};

// Whether it is known where the plate's camera looks.
bool is_placed(const Set& set) {
  const PoseSettings& pose = set.camera.pose;
  return set.camera.lens.width > 0 &&
         (!pose.track.empty() || pose.cam_from_set != calibrate::Pose{});
}

Collected collect(const Set& set, const std::vector<PaintedPatch>& patches, std::int64_t frames) {
  FrameMaker maker(set);
  const std::int64_t count = maker.plate().is_still() ? 1 : frames;
  Collected collected;
  std::vector<calibrate::LightPair>& pairs = collected.pairs;
  std::shared_ptr<const capture::HalfImage> last;
  for (std::int64_t n = 0; n < count; ++n) {
    const auto prepared =
        maker.plate().is_live() ? maker.make_at(maker.wait_for_plate()) : maker.make(n);
    if (!prepared) break;
    if (prepared->plate == last) continue;  // shown again, it tells nothing new
    last = prepared->plate;
    const capture::Image plate = even_plate(*prepared);
    const auto frame = static_cast<std::size_t>(n);
    if (pairs.empty()) collected.exposure_s = prepared->plate_exposure_s;
    if (patches.empty()) {
      add_overlap(*prepared, plate, frame, pairs);
    } else {
      add_patches(patches, plate, *prepared->environment, frame, pairs, collected.doubt);
      if (is_placed(set)) add_overlap(*prepared, plate, frame, collected.overlap);
    }
  }
  return collected;
}

// What both cameras' directions tell of the exposures that a fit by patches found: their ratio, the
// median of the frames; nothing if too few are seen. They are of things far away, patches are not.
// The pairs are in the frames' order.
std::optional<double> told_by_overlap(const calibrate::LightGain& found,
                                      std::span<const calibrate::LightPair> overlap) {
  std::vector<double> ratios;
  for (std::size_t frame = 0; frame < found.exposures.size(); ++frame) {
    const auto pairs = std::ranges::equal_range(overlap, frame, {}, &calibrate::LightPair::frame);
    if (pairs.size() < ExposureFollower::fewest_pairs || !(found.exposures[frame] > 0)) continue;
    try {
      ratios.push_back(calibrate::follow_exposure(found, pairs) / found.exposures[frame]);
    } catch (const std::invalid_argument&) {
      // A matrix that takes what is far away below 0.
    }
  }
  if (ratios.empty()) return std::nullopt;
  const double told = capture::median_in_place(ratios);
  return told > 0.01 && told < 100 ? std::optional(told) : std::nullopt;  // as sets may have it
}

struct Fit {
  calibrate::LightGain light;
  std::optional<double> overlap;  // beside patches: what both cameras' directions tell
};

// What the probe did not see is filled from the plate, in its units: with the gain of a first
// round, both are of one unit.
Fit fit(Set set,
        const std::vector<PaintedPatch>& patches,
        std::int64_t frames,
        Collected& collected) {
  const bool fills =
      !patches.empty() && set.probe->lens.has_value() && set.probe->unseen == render::Unseen::floor;
  Colour before{1, 1, 1};
  Fit all;
  calibrate::LightGain& found = all.light;
  for (int round = 0; round < (fills ? 3 : 1); ++round) {
    set.probe->match = MatchSettings{};
    set.probe->match.method = MatchSettings::Method::given;
    for (std::size_t c = 0; c < 3; ++c) {
      if (round > 0) before[c] = found.gain[c];
      set.probe->match.gain[c] = static_cast<float>(before[c]);
    }
    collected = collect(set, patches, frames);
    if (!patches.empty() && collected.pairs.empty()) {
      throw std::runtime_error(fmt::format(
          "{}: none of {} patches tells anything: all are clipped, dark or unlit in every frame; "
          "name others of the plate",
          patches.front().where, patches.size()));
    }
    found = calibrate::fit_light_gain(collected.pairs);
    if (!patches.empty()) all.overlap = told_by_overlap(found, collected.overlap);
    for (std::size_t c = 0; c < 3; ++c) found.gain[c] *= before[c];
    for (std::size_t i = 0; found.matrix && i < 9; ++i) (*found.matrix)[i] *= before[i % 3];
  }
  return all;
}

std::string list_of(std::span<const double> numbers) {
  std::string list;
  for (const double number : numbers) {
    list += fmt::format("{}{:.6g}", list.empty() ? "" : ", ", number);
  }
  return "[" + list + "]";
}

// The least and greatest exposure of the plate's frames that have one.
std::pair<double, double> exposures_of(const calibrate::LightGain& found) {
  std::pair<double, double> range{1, 1};
  for (const double exposure : found.exposures) {
    if (!(exposure > 0)) continue;
    range = {std::min(range.first, exposure), std::max(range.second, exposure)};
  }
  return range;
}

// As a set's [probe] takes it.
std::string match_line(const Fit& fit, double exposure_s) {
  const calibrate::LightGain& found = fit.light;
  const std::span<const double> numbers =
      found.matrix ? std::span<const double>(*found.matrix) : std::span<const double>(found.gain);
  const auto [low, high] = exposures_of(found);
  if (high / low < follows_from) return "match = " + list_of(numbers);
  return fmt::format("match = {{ {} = {}, follow = true{}{} }}", found.matrix ? "matrix" : "gain",
                     list_of(numbers),
                     exposure_s > 0 ? fmt::format(", exposure_s = {:.9g}", exposure_s) : "",
                     fit.overlap ? fmt::format(", overlap = {:.4g}", *fit.overlap) : "");
}

void calibrate_light(const LightOptions& options, Console& console) {
  Set set = read_set(options.set);
  if (!set.probe) throw std::runtime_error(set.path + ": has no [probe] to match to the plate");
  if (options.patches.empty() && !is_placed(set)) {
    throw std::runtime_error(set.path +
                             ": the camera's lens and pose are needed to find what both cameras "
                             "see; or give --patches");
  }
  // Nothing virtual is needed for it.
  set.objects.clear();
  set.stand_ins.clear();
  set.lamps.clear();
  set.videos.clear();
  set.persons.clear();
  const auto patches =
      options.patches.empty()
          ? std::vector<PaintedPatch>{}
          : read_patches(options.patches, std::array{set.show.width, set.show.height});
  Collected collected;
  Fit fitted;
  calibrate::LightGain& found = fitted.light;
  try {
    fitted = fit(set, patches, options.frames.value_or(default_frames), collected);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{}: {}", set.path, error.what()));
  }
  const std::vector<std::string> untold = untold_patches(patches, collected.pairs);
  found.warnings.insert(found.warnings.begin(), untold.begin(), untold.end());
  if (!collected.doubt.empty()) found.warnings.push_back("the gains are " + collected.doubt);
  if (const double told = fitted.overlap.value_or(1);
      told * most_off_overlap < 1 || told > most_off_overlap) {
    found.warnings.push_back(fmt::format(
        "directions that both cameras see tell {:.2g} of the patches' gain: the probe or "
        "the plate's camera looks elsewhere than is said, what both see is near, or a patch has "
        "another albedo or normal",
        told));
  }
  const std::size_t pairs = collected.pairs.size();
  const std::string match = match_line(fitted, collected.exposure_s);
  Json figures{
      {"gain", found.gain}, {"sigma", found.sigma},       {"heldout_error", found.heldout_error},
      {"pairs", pairs},     {"left_out", found.left_out}, {"exposures", found.exposures}};
  if (found.matrix_heldout_error) figures["matrix_heldout_error"] = *found.matrix_heldout_error;
  if (found.matrix) figures["matrix"] = *found.matrix;
  if (fitted.overlap) figures["overlap"] = *fitted.overlap;
  figures["match"] = match;
  figures["warnings"] = found.warnings;
  console.figures(json_text(figures));
  for (const std::string& warning : found.warnings) console.warn(warning);
  const bool too_few = std::ranges::all_of(found.sigma, [](double sigma) { return sigma >= 1; });
  console.say(fmt::format("from {} {}: {}{}", pairs,
                          patches.empty() ? "directions that both cameras see" : "painted patches",
                          too_few ? "too few to tell how sure it is"
                          : found.heldout_error > calibrate::doubtful_heldout_error
                              ? "how sure it is cannot be told, for they disagree"
                              : fmt::format("+- {:.2f}, {:.2f}, {:.2f} %", 100 * found.sigma[0],
                                            100 * found.sigma[1], 100 * found.sigma[2]),
                          std::isfinite(found.heldout_error)
                              ? fmt::format("; held-out error {:.1f} %", 100 * found.heldout_error)
                              : ""));
  if (found.matrix) {
    console.say(fmt::format("the cameras' colours differ: with a matrix, held-out error {:.1f} %",
                            100 * found.matrix_heldout_error.value_or(0)));
  }
  if (found.exposures.size() > 1) {
    const auto [low, high] = exposures_of(found);
    console.say(fmt::format("the plate's exposure goes from {:.3f} to {:.3f} of its first frame's",
                            low, high));
  }
  if (fitted.overlap) {
    console.say(fmt::format(
        "directions that both cameras see tell {:.3f} of this gain: with follow = true, say "
        "overlap = {:.4g}",
        *fitted.overlap, *fitted.overlap));
  }
  console.say(match);
}

}  // namespace

Command calibrate_light_command() {
  return {"calibrate light", "Measure the gain from a set's lightprobe to its plate",
          "platelight calibrate light demo/car.toml --patches demo/calibration/patches.toml",
          [](Arguments& arguments) -> std::function<void(Console&)> {
            auto o = std::make_shared<LightOptions>();
            arguments.positional("SET", o->set, "set file with a camera and a probe");
            arguments.option("--patches", o->patches,
                             ".toml file of a grey card or chart in the plate; without it, from "
                             "what both cameras see");
            arguments.option("--frames", o->frames, 1, 10'000,
                             "frames of the plate, each with an exposure of its own; 25 if not "
                             "said");
            return [o](Console& console) { calibrate_light(*o, console); };
          }};
}

}  // namespace studio
