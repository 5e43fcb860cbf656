// Radiance as the lightprobe measures it: a picture that stays, or a camera that brackets.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "capture/image.h"
#include "capture/pool.h"
#include "studio/set.h"
#include "studio/source.h"

namespace studio {

// Merges a camera that cycles through exposures: every new shot takes the place of the one before
// of about the same exposure, so that each shot gives a new radiance picture, at the camera's full
// rate.
class RollingBracket {
 public:
  // `exposures_s`: one for each place of the cycle, each > 0.
  explicit RollingBracket(std::vector<double> exposures_s);

  // A shot, linear, 1 = saturated: (height, width, 3), all of one size. Throws
  // std::invalid_argument for another size.
  void add(std::shared_ptr<const capture::Image> linear, double exposure_s);
  // Radiance in sensor units per second, of the shots that were seen; at least one must have been.
  std::shared_ptr<const capture::Image> merge();

 private:
  struct Slot {
    double exposure_s;
    std::shared_ptr<const capture::Image> linear;  // null = not seen yet
  };

  int height_ = 0, width_ = 0;
  std::vector<Slot> slots_;
  capture::Pool<capture::Image> pool_;
};

// One thread uses it.
class ProbeSource {
 public:
  // Opens or merges what the set names. Throws SetError.
  explicit ProbeSource(const Set& set);

  struct Radiance {
    std::shared_ptr<const capture::Image> image;  // (height, width, 3)
    capture::Time time{};
  };
  // The newest at a time of the show, which must not fall. The same pointer as before if there is
  // nothing newer; when the camera has ended, its last.
  Radiance at(capture::Time time);

 private:
  void open_camera(const Set& set, const ProbeSettings& probe);
  void prime();
  void take(const std::vector<capture::Frame>& frames);
  double exposure_s_of(const capture::Frame& frame) const;

  std::vector<double> exposures_s_;
  capture::Time offset_{};
  std::unique_ptr<Source> camera_;  // null = the radiance stays
  std::unique_ptr<RollingBracket> bracket_;
  Radiance newest_;
};

}  // namespace studio
