// Which exposure made which frame, where a camera is told a new one for every frame.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "capture/radiance_check.h"

namespace capture {

enum class LabelVerdict {
  accepted,
  rejected,
  unknown,  // black or saturated: the exposure cannot be told from its neighbours
};

enum class LabelReason {
  none,         // accepted
  lag_unknown,  // no lag explains a whole bracket of frames yet, or the light changes too fast
  mislabelled,  // the light does not fit the exposure that the lag foretells
  mixed,        // the light of some rows does not
  repeated,     // the picture is the one before
  unchecked,    // what it could be checked against is too old
  dark,         // unknown
  saturated,    // unknown
};

// For people: "mixed: rows of two exposures".
const char* words_of(LabelReason reason);

struct ExposureLabel {
  LabelVerdict verdict = LabelVerdict::rejected;
  LabelReason reason = LabelReason::lag_unknown;
  double exposure_s = 0;   // accepted: what made the frame; else 0
  double predicted_s = 0;  // what lag or camera say, 0 = nothing
  FitResult evidence;      // of the check against earlier frames
};

struct LabelSettings {
  NoiseModel noise;           // of linear values, 1 = saturated
  double light_drift = 0.03;  // change of all light from frame to frame that is no contradiction
  int most_lag = 8;           // frames
  int most_lost = 3;          // in a row; after more the camera may have been opened anew
};

// Labels frame after frame, each when it arrives, with nothing but earlier ones.
//
// A request made after frame n was received acts on frame n + 1 + lag and those after it, until the
// next one acts. The lag is what explains the light of a whole bracket: while it is not known, or
// doubted, a run of frames is kept for each possible lag, with the radiance that its labels tell.
// Where a frame contradicts it, a run starts anew. A run is believed if it has agreeing frames with
// the shortest and the longest exposure, or, where these tell nothing, has been through all
// exposures since the first that told, and no run of another label is as old: no wrong lag can do
// that, since labels that are wrong by a constant factor would need an exposure beyond the longest
// or shortest. The first frame of a run agrees if the next one does with it, finely: it may be the
// one that went wrong.
//
// But one frame that goes wrong can hide where a wrong lag fails. So more is asked of a lag than a
// run: that it has failed in fewer frames than every other lag that agreed with some (before its
// first request acts, a lag says that the exposure stays, and fails where the light shows that it
// does not). Where the camera was opened anew, and the light is not what it was, by more than half
// the way to the next exposure, a run in which the shortest and the longest exposure do not both
// tell must have gone twice through all exposures; if its lag is another than the one believed,
// four times, unless it has failed in two frames less.
//
// With the lag known, a frame is accepted if the exposure that the lag foretells fits what accepted
// frames before it told of the light. If not, it is rejected, and the lag is put in doubt: runs
// begin, beside it. So all of a lag that changes, light that changes and a frame gone wrong are
// rejected at first. They end differently: after a wrong frame the next one fits the known light
// again; after the other two, a run of one bracket is believed. A wrong frame that the known light
// explains (mixed, or made by another exposure in play) begins no run, unless another follows.
// After a wrong frame, two thirds of the values must agree where the known light tells but roughly;
// after one that it does not explain, the picture must also be neither dark nor saturated; after
// three of these, such light counts no more.
//
// Lags that foretell the same (those a whole bracket apart, until a frame is lost) are kept
// together, until one of them is contradicted.
//
// What cannot be told:
// - That all light changes by about the ratio of two exposures (nearer to it than to none), and
//   before a bracket has passed a label is wrong by just that ratio, as a frame repeated or lost
//   without being counted makes it. Either alone is told.
// - That a camera takes another gain or exposure than those in play, if it looks like light that
//   drifts or was switched. So a camera that is opened anew must leave out more than most_lost
//   frames, or be told of (restart).
// - That part of a picture is of another exposure if no value there tells it.
class ExposureLabeller {
 public:
  // Throws std::invalid_argument for settings below 0.
  explicit ExposureLabeller(const LabelSettings& settings);

  // The exposures that will be asked for. They may change at any time; earlier ones stay in play
  // while frames of theirs may come. Throws std::invalid_argument for none, or one not above 0.
  void set_schedule(std::span<const double> exposures_s);
  // The camera was asked for (took) this exposure when `after_frame` was the last frame received:
  // any number before the first one's if there was none. Throws std::invalid_argument if it is not
  // above 0.
  void requested(std::int64_t after_frame, double exposure_s);
  // The next received frame, in the order of numbers, which count lost frames. Where the camera
  // tells the exposure with the frame, `told_s` is the label, still to be checked. Where numbers
  // fall or leave out more than most_lost, requests and lag are forgotten.
  // Throws std::invalid_argument if the thumbnail's size changes.
  ExposureLabel label(std::int64_t number, const Thumbnail& thumbnail, double told_s = 0);
  // The lag in frames; nothing while it is not known or none is needed.
  std::optional<int> lag() const;
  // The camera has been opened anew: forgets requests, lag and light.
  void restart();

 private:
  struct Request {
    std::int64_t after_frame = 0;
    double exposure_s = 0;
  };
  // Frames that one lag explains.
  struct Run {
    explicit Run(const LabelSettings& settings) : light(settings.noise, settings.light_drift) {}
    RadianceReference light;
    std::int64_t since = 0;
    double first_s = 0;       // its first label
    bool first_seen = false;  // its first frame was neither dark nor saturated
    int frames = 0;
    bool moved_on = false;           // there were others
    int cycles = 0;                  // through all exposures in play
    std::vector<double> labelled_s;  // distinct labels since the last one
    std::vector<double> agreed_s;    // of those that told and agreed
    double current_s = 0;            // of the newest frame
    FitResult fit;
    // Of earlier runs, too, since the search began:
    std::deque<std::int64_t> failed;  // frames of late that contradicted
    int agreed = 0;                   // frames
  };

  double predicted(std::int64_t number, int lag) const;
  void note_in_play();
  TriedExposure tried(std::int64_t number, int lag, double exposure_s) const;
  std::optional<FitResult> check_known(std::int64_t number,
                                       const Thumbnail& thumbnail,
                                       double told_s,
                                       double& label_s);
  bool explains(const FitResult& fit,
                std::int64_t number,
                const Thumbnail& thumbnail,
                double label_s) const;
  void extend_runs(std::int64_t number, const Thumbnail& thumbnail, double told_s);
  void extend_run(
      Run& run, int lag, std::int64_t number, const Thumbnail& thumbnail, double label_s);
  bool complete(std::size_t lag) const;
  bool fails_least(std::size_t lag) const;
  bool as_before(const Run& run) const;
  std::optional<std::size_t> believed_run() const;
  void believe(std::size_t lag, std::int64_t number, double told_s);
  ExposureLabel verdict_of(const FitResult& fit, const Thumbnail& thumbnail, double label_s) const;
  ExposureLabel without_lag(const Thumbnail& thumbnail) const;
  bool repeats(const Thumbnail& thumbnail) const;

  LabelSettings settings_;
  std::vector<double> schedule_s_;
  std::deque<Request> requests_;
  std::vector<double> in_play_s_;  // in order of length
  RadianceReference known_;        // the light as accepted frames tell it
  RadianceReference before_;       // the same before the camera was opened anew
  std::vector<int> lags_;          // that are believed; empty = none yet
  bool searching_ = true;
  int contradictions_ = 0;  // frames in a row that the known light does not explain
  // The frame before was wrong, but its light was the known one.
  bool explained_before_ = false;
  double explained_s_ = 0;    // the newest such label of which no frame was right since
  std::vector<Run> runs_;     // by lag
  bool before_sure_ = false;  // the exposure of the frame before is known
  std::optional<std::int64_t> accepted_;
  std::optional<std::int64_t> last_number_;
  Thumbnail last_;
};

}  // namespace capture
