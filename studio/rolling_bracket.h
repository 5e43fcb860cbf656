// The window of shots that a lightprobe's radiance is merged from.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "capture/flicker.h"
#include "capture/image.h"
#include "capture/live_merge.h"
#include "capture/pool.h"

namespace studio {

// Merges a camera that cycles through exposures: every new shot takes the place of the one before
// of about the same exposure, so that each shot gives a new radiance picture, at the camera's full
// rate. A shot whose exposure does not come again for a while stays for eight cycles. Lamps that
// are seen to flicker (capture/flicker.h) are levelled.
class RollingBracket {
 public:
  // `cycle` is how many shots the camera takes until its exposures repeat, 1 to 16.
  explicit RollingBracket(std::size_t cycle, capture::WindowMergeSettings settings = {});

  // So many shots are taken until exposures repeat, 1 to 16; any may come.
  void set_cycle(std::size_t cycle);
  // The exposures that the camera takes in turn have changed: shots of others stay for two cycles.
  // Throws std::invalid_argument for none, or more than 16.
  void set_cycle(std::span<const double> exposures_s);

  // Shot number `number` of the camera, rising; linear, 1 = saturated: (height, width, 3), all of
  // one size. Throws std::invalid_argument for another size, or an exposure that is not > 0.
  // `time` is the middle of its exposure.
  void add(std::shared_ptr<const capture::Image> linear,
           double exposure_s,
           std::int64_t number,
           capture::Time time);
  std::size_t shots() const { return shots_.size(); }
  // Radiance that the longest of the shots can just tell from black.
  double least_radiance() const;
  // Of the shots that were added; at least one must have been.
  std::shared_ptr<const capture::MergedFrame> merge();
  // Of the lamps, as the last merges saw them.
  const std::optional<capture::Flicker>& flicker() const { return flicker_; }

 private:
  struct Member {
    std::shared_ptr<const capture::Image> linear;
    double exposure_s;
    std::int64_t number;
    capture::Time time;
  };

  bool comes_again(double exposure_s) const;
  void watch(const capture::MergedFrame& merged);

  capture::WindowMergeSettings settings_;
  std::int64_t cycle_;
  std::vector<double> exposures_s_;  // of the cycle; empty = any may come
  std::vector<Member> shots_;        // the newest last
  std::vector<capture::LiveShot> window_;
  capture::FlickerWatch watch_;
  std::int64_t watched_ = -1;  // the newest shot that was
  std::optional<capture::Flicker> flicker_;
  capture::Pool<capture::MergedFrame> pool_;
};

}  // namespace studio
