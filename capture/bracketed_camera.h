// A camera whose exposure changes from frame to frame, each frame labelled with the one that made
// it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/auto_exposures.h"
#include "capture/camera.h"
#include "capture/exposure_labels.h"
#include "capture/light_meter.h"

namespace capture {

// Asks a camera for one exposure of a schedule after each frame that arrives, in turn for ever, and
// says of each frame which of them made it (see ExposureLabeller). Images are as the camera gives
// them; their values must be linear, with 1 = saturated.
//
// Frame::exposure_s is what made the frame if that is sure. If not it is 0, with status damaged and
// a note, where the picture does not fit (mixed, repeated, asked for in vain, or the lag is not
// known yet). A picture too dark or too bright to tell has its status as it was, a note, and what
// the lag foretells, 0 while that is not known. Frames that arrive lost or damaged are passed on,
// with exposure 0.
class BracketedCamera final : public Camera {
 public:
  // Asks for each exposure once, to see what the device makes of it. `name` is for messages.
  // Throws std::invalid_argument for no exposures, std::runtime_error naming the camera, with what
  // was asked and what is possible, if its exposure cannot be set from frame to frame, an exposure
  // is out of its range or longer than a frame, two are one to the device, or it refuses.
  BracketedCamera(std::unique_ptr<Camera> camera,
                  std::string name,
                  std::span<const double> exposures_s,
                  const LabelSettings& settings);

  // Exposures that follow the light (see AutoExposures), from all that the camera can set within
  // its frames; `settings.choice.possible` is not used. Throws as above, and for an error that no
  // exposure has.
  BracketedCamera(std::unique_ptr<Camera> camera,
                  std::string name,
                  const AutoExposureSettings& exposures,
                  LightMeterSettings meter,
                  const LabelSettings& settings);

  // Other exposures from the next request on; merges that hold older frames go on with them. Throws
  // as the constructor, but asks the device for nothing yet. Those that are new come first.
  void set_exposures(std::span<const double> exposures_s);
  // What the device makes of the schedule, in its order.
  std::vector<double> exposures_s() const;

  const CameraInfo& info() const override { return camera_->info(); }
  std::optional<Frame> next() override;
  std::optional<Sound> take_sound(Time until) override { return camera_->take_sound(until); }
  CameraStatistics statistics() const override;
  std::optional<ExposureRange> exposure_range() const override { return camera_->exposure_range(); }

 private:
  struct Member {
    double asked_s = 0;
    double taken_s = 0;  // as the device rounds it
  };
  void try_all();
  ExposureRange range() const;
  ExposureRange possible() const;
  void check(std::span<const double> exposures_s) const;
  void follow_light(const Frame& frame);
  void request(std::int64_t after_frame);
  void schedule_members();

  std::unique_ptr<Camera> camera_;
  std::string name_;
  ExposureLabeller labeller_;
  std::vector<Member> members_;
  std::size_t turn_ = 0;      // of the next request
  std::int64_t damaged_ = 0;  // by our verdict
  std::int64_t refused_ = 0;  // requests
  std::string refusal_;       // of the last one
  // Of exposures that follow the light.
  std::optional<AutoExposures> auto_;
  std::optional<LightMeter> meter_;
};

}  // namespace capture
