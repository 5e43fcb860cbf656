// Windows of made shots, and their merges.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "capture/hdr.h"
#include "capture/live_merge.h"
#include "capture/made_sensor.h"

namespace capture::made_window {

// 12 bit: radiance 1 fills the well in 1 s.
inline MadeSensor camera() {
  return {.full_well_e = 20000, .read_noise_e = 4, .bits = 12, .pedestal = 64};
}

inline LinearCodes codes_of(const MadeSensor& sensor, int width, int height) {
  const double white = (1 << sensor.bits) - 1;
  return {
      width, height, {sensor.pedestal, sensor.pedestal, sensor.pedestal}, {white, white, white}};
}

// The newest shots of a camera, the newest last.
struct Window {
  std::vector<MadeShot> taken;
  std::vector<double> exposures_s;

  std::vector<CodedShot16> shots() const {
    std::vector<CodedShot16> shots;
    for (std::size_t i = 0; i < taken.size(); ++i) {
      shots.push_back({taken[i].codes, exposures_s[i]});
    }
    return shots;
  }
};

inline Window take(const MadeSensor& sensor,
                   const Image& radiance,
                   const std::vector<double>& exposures_s,
                   std::uint64_t first_shot) {
  Window window;
  for (const double exposure_s : exposures_s) {
    window.taken.push_back(expose(sensor, radiance, exposure_s, first_shot++));
    window.exposures_s.push_back(exposure_s);
  }
  return window;
}

inline Image grey(double radiance, int width, int height) {
  Image image = make_image(height, width);
  for (float& value : image.pixels) value = static_cast<float>(radiance);
  return image;
}

inline MergedFrame merge(const Window& window,
                         const MadeSensor& sensor,
                         double consistency = WindowMergeSettings{}.consistency) {
  MergedFrame frame;
  merge_window(window.shots(), codes_of(sensor, window.taken[0].width, window.taken[0].height),
               {.noise = noise_of(sensor), .consistency = consistency}, frame);
  return frame;
}

inline std::vector<LiveShot> live_shots(const std::vector<Shot>& shots) {
  std::vector<LiveShot> live;
  for (const Shot& shot : shots) live.push_back({&shot.linear, shot.exposure_s});
  return live;
}

}  // namespace capture::made_window
