// Radiance as the lightprobe measures it: a picture that stays, or a camera that brackets.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/flicker.h"
#include "capture/image.h"
#include "capture/live_merge.h"
#include "studio/file_times.h"
#include "studio/rolling_bracket.h"
#include "studio/set.h"
#include "studio/source.h"

namespace studio {

// How the probe's light stands.
struct ProbeStatus {
  bool live = false;      // a camera's, which goes on; else a picture that stays
  capture::Time age{};    // of the newest shot in the light, at the time that was asked for
  std::size_t shots = 0;  // that the newest radiance was merged from
  // Of its pixels, by capture::MergeStatus.
  std::array<double, capture::merge_status_count> shares{};
  std::int64_t frames = 0;          // of the camera, up to now; the following are among them
  std::int64_t lost = 0;            // did not come
  std::int64_t rejected = 0;        // were damaged, or their exposure was not known for certain
  std::optional<int> exposure_lag;  // of a camera that is told its exposures, once it is known
  // Of such a camera, now; of exposures that follow the light, whether it is beyond the camera's.
  std::vector<double> exposures_s;
  bool too_bright = false;
  bool too_dark = false;
  std::int64_t refused = 0;                 // exposures that such a camera did not take
  std::string refusal;                      // why, of the last one
  std::optional<capture::Flicker> flicker;  // of lamps, which is levelled
  std::string kept_because;  // why the last good light stays on air; "" = the light is new
};

// One thread uses it.
class ProbeSource {
 public:
  // Opens or merges what the set names. A recording is in step with the plate: where it is first
  // asked for at `from` of the show's time, it begins there. It brackets if two exposures are known
  // among its first 16 frames, or later; lost, damaged and unlabelled ones are passed over. Throws
  // SetError.
  explicit ProbeSource(const Set& set, std::optional<capture::Time> from = std::nullopt);

  // Whether it may go on for another set: it is a camera, and that set has the same one, asked in
  // the same way. The set's light may differ.
  bool serves(const Set& set) const;
  // Whether it is a live camera that another set's probe wants as well, which may be denied.
  bool holds_camera_of(const Set& set) const;
  // Of the radiance, pixels.
  int height() const { return height_; }
  int width() const { return width_; }

  struct Radiance {
    std::shared_ptr<const capture::Image> image;  // (height, width, 3)
    capture::Time time{};                         // of the newest shot in it
  };
  // The newest at a time of the show, which must not fall: what was taken by then, not what is
  // stamped by then. The same pointer as before if there is
  // nothing newer; when the camera has ended, its last. Where the newest shots tell nothing, since
  // all is saturated or all is black, the last good one stays. Where the show's time is not the
  // monotonic clock (`on_clock`), for its plate is a file, a live camera gives its newest; where it
  // is, for its plate is live, a recording begins when it is first asked.
  Radiance at(capture::Time time, bool on_clock = true);
  const ProbeStatus& status() const { return status_; }
  // What a user should know of a bracket of shots, since the last call.
  std::vector<std::string> take_notes() { return std::exchange(notes_, {}); }

 private:
  void open(const Set& set, std::optional<capture::Time> from);
  void open_camera(const Set& set, const ProbeSettings& probe, std::optional<capture::Time> from);
  void prime();
  // What frames tell that are taken together.
  struct Taken {
    bool any = false;
    std::optional<capture::Time> fresh;  // of the newest that tells new light
    std::string last_note;
  };
  void prime_live(std::size_t cycle);
  void note_camera();
  capture::Frame wait_for_next();
  void take(const capture::Frame& frame, Taken& taken);
  void take(const std::vector<capture::Frame>& frames);
  void take_until(capture::Time time);
  void show(const Taken& taken);
  bool tells_exposure(const capture::Frame& frame) const;
  bool add(const capture::Frame& frame);
  void merge(capture::Time time);
  double exposure_s_of(const capture::Frame& frame) const;

  ProbeSettings settings_;
  bool loop_ = false;
  FileTimes times_;  // of the response, when it was read
  int height_ = 0, width_ = 0;
  std::vector<double> exposures_s_;
  capture::Time offset_{};              // its clock less the show's
  std::optional<capture::Time> begun_;  // of a recording in a show on the monotonic clock, then
  capture::Time passed_{};              // of a recording that loops: by passes before it was opened
  std::vector<std::size_t> seen_;       // some of the pixels that the lens sees, evenly spread
  capture::WindowMergeSettings merging_;     // with the camera's noise, if calibration has told it
  std::unique_ptr<Source> camera_;           // null = the radiance stays
  std::unique_ptr<RollingBracket> bracket_;  // null while no two exposures are known
  capture::Frame single_;                    // the newest of the one exposure that is known
  std::vector<capture::Frame> ahead_;        // read already, and not due yet
  Radiance newest_;
  ProbeStatus status_;
  std::vector<std::string> notes_;
  bool is_told_ahead_ = false;
};

}  // namespace studio
