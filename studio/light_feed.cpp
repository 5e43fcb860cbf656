// Light of shows.
#include "studio/light_feed.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "studio/light_pairs.h"

namespace studio {
namespace {

constexpr int environment_height = 256;
// The gain is averaged over about this many frames, and starts anew on a change beyond noise.
constexpr double gain_frames = 12;
constexpr double sudden_gain = 0.2;
// Smaller changes than this, of the gain or the floor, leave the environment as it is.
constexpr double gain_step = 0.01;

[[noreturn]] void fail(const Set& set, const std::string& message) {
  const Place place = set.probe->source_place;
  throw SetError({{set.path, place.line, place.column, message}});
}

std::shared_ptr<render::Environment> darkness() {
  auto env = std::make_shared<render::Environment>();
  env->radiance = capture::make_image(8, 16, 3);
  env->seen.assign(8 * 16, 0);
  render::smooth_for_reflections(*env);
  return env;
}

// The mean of the plate's pixels that look down: what the floor sends. Every eighth row and column
// will do.
std::optional<calibrate::Vec3f> floor_of_plate(const capture::Image* plate,
                                               const LightRequest& request) {
  if (plate == nullptr || request.directions == nullptr) return std::nullopt;
  constexpr int step = 8;
  constexpr double level = -0.05;  // z of a direction just under the horizon
  const calibrate::DirectionTable& directions = *request.directions;
  const auto& m = request.cam_from_set.R.m;
  std::array<double, 3> sum{};
  int pixels = 0;
  for (int y = 0; y < directions.height; y += step) {
    for (int x = 0; x < directions.width; x += step) {
      const std::size_t i = directions.index(y, x);
      const double up = m[2] * directions.x[i] + m[5] * directions.y[i] + m[8] * directions.z[i];
      if (!(up < level)) continue;
      for (int c = 0; c < 3; ++c) {
        sum[static_cast<std::size_t>(c)] += render::counted_radiance(plate->at(y, x, c));
      }
      ++pixels;
    }
  }
  if (pixels == 0) return std::nullopt;
  return calibrate::to_float({sum[0] / pixels, sum[1] / pixels, sum[2] / pixels});
}

bool differ(const calibrate::Vec3f& a, const calibrate::Vec3f& b) {
  const auto apart = [](float u, float v) {
    return std::abs(u - v) > static_cast<float>(gain_step) * std::max(u, v);
  };
  return apart(a.x, b.x) || apart(a.y, b.y) || apart(a.z, b.z);
}

// The probe that `before` has open, or the set's own.
std::shared_ptr<ProbeSource> open_probe(const Set& set,
                                        const std::shared_ptr<ProbeSource>& before,
                                        std::optional<capture::Time> from) {
  if (before && before->serves(set)) return before;
  try {
    return std::make_shared<ProbeSource>(set, from);
  } catch (const SetError& error) {
    if (!before || !before->holds_camera_of(set)) throw;
    fail(set,
         fmt::format("{}. It is on air: what is asked of the probe's camera changes only where "
                     "it can be opened twice; else start anew",
                     error.diagnostics().front().message));
  }
}

}  // namespace

LightFeed::LightFeed(const Set& set, const LightFeed* before, std::optional<capture::Time> from)
    : settings_(set.probe) {
  if (!settings_) {
    environment_ = darkness();
    return;
  }
  source_ = open_probe(set, before ? before->source_ : nullptr, from);
  goes_on_ = before && source_ == before->source_;
  if (settings_->match.method == MatchSettings::Method::given) {
    match_ = given_match(1);
    exposure_ = ExposureFollower(settings_->match.exposure_s, settings_->match.overlap);
  }
  if (!settings_->lens) {
    if (source_->width() != 2 * source_->height()) {
      fail(set, "a latitude-longitude map must be twice as wide as high");
    }
    return;
  }
  const calibrate::Lens& lens = *settings_->lens;
  if (source_->width() != lens.width || source_->height() != lens.height) {
    fail(set, "the probe's picture is " + std::to_string(source_->width()) + "x" +
                  std::to_string(source_->height()) + ", but its lens is for " +
                  std::to_string(lens.width) + "x" + std::to_string(lens.height));
  }
  render::ProbeSettings mapping;
  mapping.height = environment_height;
  mapping.unseen = settings_->unseen;
  mapping.vignetting = settings_->vignetting;
  try {
    mapper_ = std::make_unique<render::ProbeMapper>(lens, settings_->probe_from_set, mapping);
  } catch (const std::invalid_argument& error) {
    fail(set, error.what());
  }
}

std::vector<std::string> LightFeed::take_notes() {
  std::vector<std::string> notes = source_ ? source_->take_notes() : std::vector<std::string>{};
  const bool given = settings_ && settings_->match.method == MatchSettings::Method::given;
  const bool lacks_gain = !given && !matched_ && !match_.note.empty();
  const bool is_doubtful = lacks_gain || match_.doubtful;
  if (is_doubtful && !was_doubtful_) notes.push_back("the light's match: " + match_.note);
  was_doubtful_ = is_doubtful;
  return notes;
}

bool LightFeed::serves(const Set& set) const {
  if (!settings_ || !set.probe) return !settings_ && !set.probe;
  if (!source_->serves(set)) return false;
  ProbeSettings asked = *set.probe;
  asked.source_place = settings_->source_place;
  return asked == *settings_;
}

// What light is measured by. The picture itself keeps its vignetting.
const capture::Image* LightFeed::even_plate(const LightRequest& request) {
  if (request.plate == nullptr || request.directions == nullptr ||
      request.directions->sensitivity.empty()) {
    return request.plate;
  }
  evened_ = *request.plate;
  for (int y = 0; y < evened_.height; ++y) {
    for (int x = 0; x < evened_.width; ++x) {
      const float sensitivity = request.directions->sensitivity[request.directions->index(y, x)];
      for (int c = 0; c < 3; ++c) evened_.at(y, x, c) /= sensitivity;
    }
  }
  return &evened_;
}

// Measures the floor of a new plate. True if it differs from the environment's.
bool LightFeed::follow_floor(const LightRequest& request) {
  if (!mapper_ || settings_->unseen != render::Unseen::floor) return false;
  if (request.plate == nullptr || request.plate == floor_plate_) return false;
  floor_plate_ = request.plate;
  const std::optional<calibrate::Vec3f> now = floor_of_plate(plate_, request);
  if (now && floor_ && !differ(*now, *floor_)) return false;
  if (!now && !floor_) return false;
  floor_ = now;
  return true;
}

void LightFeed::build_environment() {
  std::shared_ptr<render::Environment> env = environments_.lend();
  const render::ColourMatrix match = render::matrix_of(match_);
  int below_zero = 0;
  if (mapper_) {
    mapper_->map(*radiance_, {match, floor_}, *env);
    below_zero = mapper_->texels_below_zero();
  } else {
    *env = render::environment_from_map(*radiance_, settings_->yaw_rad, environment_height);
    below_zero = render::recolour(match, *env);
  }
  share_below_zero_ = 3.0 * below_zero / static_cast<double>(env->radiance.pixels.size());
  environment_ = std::move(env);
  shown_ = false;
}

// Of the plate over the environment as it is now, which already holds the gain so far.
render::MatchResult LightFeed::measure_match(const LightRequest& request) const {
  const MatchSettings& match = settings_->match;
  render::MatchSettings matching;
  if (matched_) matching.else_gain = "the last gain is held";
  if (match.method == MatchSettings::Method::patch) {
    const auto [x, y, width, height] = match.patch;
    const calibrate::Vec3f normal = calibrate::to_float(calibrate::normalize(match.normal));
    render::SplitIrradiance light = render::split_irradiance_of(*environment_, normal);
    // What is filled in goes with the gain, but for a floor of the plate's.
    if (!floor_) light = {light.seen + light.filled, {}, light.seen_share};
    render::MatchResult found = render::match_by_patch(*plate_, {x, y, width, height}, match.albedo,
                                                       light.seen, matching, light.filled);
    const std::string doubt = render::doubt_of_patch(light.seen_share);
    found.doubtful = found.pixels > 0 && !doubt.empty();
    if (found.doubtful) found.note += "; " + doubt;
    return found;
  }
  return render::match_by_overlap(*plate_, *request.directions, request.cam_from_set, *environment_,
                                  matching);
}

render::MatchResult LightFeed::given_match(double exposure) const {
  const MatchSettings& match = settings_->match;
  return match.matrix ? render::match_by_matrix(*match.matrix, exposure)
                      : render::match_given(match.gain, exposure);
}

// Follows the plate's exposure with a given match. True if the gain has changed.
bool LightFeed::follow_exposure(const LightRequest& request) {
  std::vector<calibrate::LightPair> pairs;
  int pixels = 0;
  if (exposure_.needs_pairs(request.exposure_s)) {
    const auto overlap =
        render::find_overlap(*plate_, *request.directions, request.cam_from_set, *environment_);
    for (const render::OverlapTexel& both : overlap) pixels += both.pixels;
    pairs = light_pairs_of(overlap);
  }
  exposure_.follow(request.exposure_s, match_.exposure, pairs);
  const bool changed = std::abs(exposure_.level() / match_.exposure - 1) > gain_step;
  match_ = given_match(changed ? exposure_.level() : match_.exposure);
  match_.pixels = pixels;
  match_.spread = exposure_.spread();
  match_.doubtful = exposure_.is_doubtful();
  match_.note += "; " + exposure_.note();
  return changed;
}

// Follows the plate's exposure and white. True if the gain has changed.
bool LightFeed::follow_match(const LightRequest& request) {
  const bool given = settings_->match.method == MatchSettings::Method::given;
  if (given && !settings_->match.follow) return false;
  const bool looked_at = (given || matched_) && request.plate == matched_plate_;
  if (request.plate == nullptr || looked_at) return false;
  matched_plate_ = request.plate;
  if (given) return follow_exposure(request);
  render::MatchResult measured = measure_match(request);
  const bool found = measured.pixels > 0;
  bool changed = false;
  std::array<float, 3> gain = match_.gain;
  for (std::size_t c = 0; found && c < 3; ++c) {
    const double now = static_cast<double>(match_.gain[c]) * measured.gain[c];
    const bool anew = !matched_ || std::abs(now / averaged_gain_[c] - 1) > sudden_gain;
    averaged_gain_[c] = anew ? now : averaged_gain_[c] + (now - averaged_gain_[c]) / gain_frames;
    changed = changed || std::abs(averaged_gain_[c] / gain[c] - 1) > gain_step;
  }
  for (std::size_t c = 0; changed && c < 3; ++c) gain[c] = static_cast<float>(averaged_gain_[c]);
  matched_ = matched_ || found;
  match_ = std::move(measured);
  match_.gain = gain;
  return changed;
}

void LightFeed::update_environment(const LightRequest& request) {
  const ProbeSource::Radiance newest = source_->at(request.time, request.on_clock);
  const bool fresh = newest.image != radiance_;
  radiance_ = newest.image;
  const bool new_floor = follow_floor(request);
  if (fresh || new_floor) build_environment();
  const bool new_gain = follow_match(request);
  if (new_gain) build_environment();
  if (!fresh && !new_floor && !new_gain) return;
  table_count_ = 0;
}

std::shared_ptr<const render::Environment> LightFeed::begin(const LightRequest& request) {
  if (goes_on_) return nullptr;
  Light light = at(request);
  // That plate may be gone, and another one be in its place.
  matched_plate_ = floor_plate_ = nullptr;
  return std::move(light.environment);
}

Light LightFeed::at(const LightRequest& request) {
  Light light;
  light.time = request.time;
  if (settings_) {
    plate_ = even_plate(request);
    update_environment(request);
    light.time = source_->at(request.time, request.on_clock).time;
    light.probe = source_->status();
    if (settings_->albedo_patch && request.plate != nullptr) {
      const auto [x, y, width, height] = *settings_->albedo_patch;
      render::Vec3f unmatched = render::irradiance_of(*environment_, {0, 0, 1});
      unmatched = {unmatched.x / match_.gain[0], unmatched.y / match_.gain[1],
                   unmatched.z / match_.gain[2]};
      render::imply_albedo(*plate_, {x, y, width, height}, unmatched, match_);
    }
  }
  if (table_count_ != request.light_samples) {
    if (shown_) {  // a frame may still be rendered from it
      std::shared_ptr<render::Environment> anew = environments_.lend();
      *anew = *environment_;
      environment_ = std::move(anew);
    }
    render::LightFollowerSettings following;
    following.table.count = request.light_samples;
    const std::uint64_t version_before = table_.version;
    table_ = follower_.follow(*environment_, following);
    render::smooth_for_reflections(*environment_, follower_.compact_texels());
    if (!planned_ || table_.version != version_before) planned_ = environment_;
    table_.unseen_share = environment_->unseen_share;
    table_count_ = request.light_samples;
  }
  light.table = table_;
  light.environment = environment_;
  shown_ = true;
  light.planned = planned_ ? planned_ : light.environment;
  light.match = match_;
  if (share_below_zero_ > 0) {
    light.match.note += fmt::format(
        "; in {:.2g} % of the light's directions it takes colours below "
        "0, which count as 0",
        100 * share_below_zero_);
  }
  return light;
}

}  // namespace studio
