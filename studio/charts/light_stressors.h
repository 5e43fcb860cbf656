// Skies that a table of lights finds hard, and what it expects of itself there.
#pragma once

#include <memory>
#include <vector>

#include "studio/chart.h"
#include "studio/charts/matte_shot.h"
#include "studio/console.h"

namespace studio {

// With methods that measure one thing each, at the default method of the table. All arguments must
// outlive it.
class LightStressors {
 public:
  // `shot` under `sky`, whose truth is given.
  LightStressors(bool quick,
                 Console& console,
                 MatteShot& shot,
                 const render::Environment& sky,
                 const Truth& truth);

  std::vector<Stressor> measure();

 private:
  // Of the time that a full run takes.
  void progress(std::string_view what, double share) { console_.progress(share, what); }
  StressorSample stressed(double value, const render::Environment& sky, int count);
  Stressor sun_size();
  Stressor sun_strength(bool exposure_locked, int count);
  Stressor compact_sources();
  Stressor light_count();
  Stressor error_bound(const Stressor& by_count);
  Stressor whole_picture();

  bool quick_;
  Console& console_;
  MatteShot& shot_;
  const render::Environment& sky_;
  const Truth& truth_;
  std::unique_ptr<MatteShot> small_;
};

}  // namespace studio
