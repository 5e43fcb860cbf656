// A scene rendered at any effort: how long that takes, and how far it is from the reference.
#pragma once

#include <map>
#include <vector>

#include "render/group_error.h"
#include "studio/paper_shot.h"
#include "studio/picture_error.h"

namespace studio {

// One effort's frames.
struct TriedEffort {
  capture::Image picture;  // (height, width, 4)
  render::PictureError error;
  std::vector<render::GroupError> groups;  // where the scene covers any of them
  render::RenderStatistics statistics;     // of a frame in which everything moves
  double moving_ms = 0;                    // all rays taken; the fastest of several frames
  double still_ms = 0;  // nothing but the light has changed; as above. 0 = not measured
  double kept_mb = 0;   // of memory that still frames take
  // Of a still frame: rays that it takes all the same, since not all cells find room to be kept.
  render::RenderStatistics still_statistics;
  float table_error = 0;  // that the light table expects of itself
};

// Error and time of a scene against its own converged reference.
class SceneTrial {
 public:
  // Renders two references of half of `paths` (at least 2) a pixel each.
  SceneTrial(PaperShot shot, int paths);

  // With `runs` of 0, one frame is rendered and no time measured.
  TriedEffort measure(const render::Effort& effort, int runs) const;

  const BenchScene& scene() const { return shot_.shot; }
  const Truth& truth() const { return truth_; }
  // Pixels that the scene covers any of: (height, width, 1).
  const capture::Image& covered() const { return covered_; }

 private:
  const BenchLight& light_of(int count) const;

  PaperShot shot_;
  Truth truth_;
  capture::Image covered_;
  mutable std::map<int, BenchLight> lights_;  // by how many of them the table has
};

}  // namespace studio
