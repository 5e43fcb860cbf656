// The light of a show: from the probe's radiance to what the kernel is lit by, frame by frame.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "capture/image.h"
#include "capture/pool.h"
#include "render/environment.h"
#include "render/light_follower.h"
#include "render/light_table.h"
#include "render/match.h"
#include "render/probe.h"
#include "studio/exposure_follower.h"
#include "studio/probe_source.h"
#include "studio/set.h"

namespace studio {

// The light of one frame, in the plate's units.
struct Light {
  std::shared_ptr<const render::Environment> environment;  // never null
  std::shared_ptr<const render::Environment> planned;      // see render::FrameInputs
  render::LightTable table;                                // without the set's own lamps
  render::MatchResult match;
  capture::Time time{};  // of the probe's newest shot
  ProbeStatus probe;
};

// What a frame tells of itself.
struct LightRequest {
  capture::Time time{};                   // of the show
  const capture::Image* plate = nullptr;  // (height, width, 3); null = none arrived yet
  const calibrate::DirectionTable* directions = nullptr;
  calibrate::Pose cam_from_set;
  double exposure_s = 0;  // of the plate, 0 = not told
  int light_samples = 64;
  bool on_clock = true;  // as of ProbeSource::at
};

// One thread uses it. Memory across frames (the followed light, the match) lives here.
class LightFeed {
 public:
  // Opens the probe of a set; a set without one is lit by nothing. A camera that `before` has open
  // runs on: `before` may do so until the first at(), and is of no more use then. `from` as of
  // ProbeSource. Throws SetError.
  explicit LightFeed(const Set& set,
                     const LightFeed* before = nullptr,
                     std::optional<capture::Time> from = std::nullopt);

  // Whether another set is lit by the same camera in the same way, so that this one may go on.
  bool serves(const Set& set) const;

  // Makes ready what the first at() would take long for, of a time that is not after it; while
  // `before` still runs. Its environment; null, and nothing done, where both have the same camera.
  std::shared_ptr<const render::Environment> begin(const LightRequest& request);

  Light at(const LightRequest& request);

  // What a user should know of the probe's material, and of a match that is doubtful or not found,
  // since the last call.
  std::vector<std::string> take_notes();

 private:
  const capture::Image* even_plate(const LightRequest& request);
  void update_environment(const LightRequest& request);
  bool follow_floor(const LightRequest& request);
  void build_environment();
  render::MatchResult measure_match(const LightRequest& request) const;
  bool follow_match(const LightRequest& request);
  render::MatchResult given_match(double exposure) const;
  bool follow_exposure(const LightRequest& request);

  std::optional<ProbeSettings> settings_;
  capture::Image evened_;                  // the present plate without its lens's vignetting
  const capture::Image* plate_ = nullptr;  // as a lens without vignetting would take it
  std::shared_ptr<ProbeSource> source_;
  bool goes_on_ = false;                         // with the source of another one
  std::unique_ptr<render::ProbeMapper> mapper_;  // null = latitude-longitude
  render::LightFollower follower_;
  std::shared_ptr<const capture::Image> radiance_;  // that the environment was made from
  const capture::Image* floor_plate_ = nullptr;     // that the floor was measured in
  std::optional<calibrate::Vec3f> floor_;           // of the environment, where it is the plate's
  const capture::Image* matched_plate_ = nullptr;
  bool matched_ = false;
  std::array<double, 3> averaged_gain_{1, 1, 1};
  ExposureFollower exposure_;  // of a given match
  render::MatchResult match_;
  bool was_doubtful_ = false;    // when notes were taken last
  double share_below_zero_ = 0;  // of the probe's directions, by the match
  // Another one for every change, never touched once it was handed out.
  std::shared_ptr<render::Environment> environment_;
  bool shown_ = false;  // has been handed out
  capture::Pool<render::Environment> environments_;
  std::shared_ptr<const render::Environment> planned_;  // of the table's version
  render::LightTable table_;                            // of environment_, if it is not stale
  int table_count_ = 0;                                 // that it was made for; 0 = stale
};

}  // namespace studio
