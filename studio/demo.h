// Made footage with its truth: plate, probe, set, and the photograph that the composite should
// match.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string_view>

#include "render/made_studio.h"

namespace studio {

struct DemoSettings {
  std::filesystem::path dir;
  render::MadeStudioSettings studio;
  int samples = 16;  // paths per pixel and part of the light
};

struct DemoFigures {
  int frames = 0;
  int shots = 0;             // of the probe
  double car_share = 0;      // of the plate's pixels
  double ground_share = 0;   // of the plate's pixels: the court, where the car does not hide it
  std::uintmax_t bytes = 0;  // of all files
};

// Called with the share that is done, 0 to 1, and what comes next.
using DemoProgress = std::function<void(double share, std::string_view what)>;

// Makes the court with its car. Writes into settings.dir, which is made if it is not there:
//
//   car.toml               the set
//   plate.mkv              the plate, with a clap at truth.json's clap_s; clap.mkv the same clap
//                          beside a flash in the picture
//   probe/                 the fish-eye's shots and frames.csv
//   scene.cameramodel, probe.toml   the lenses
//   truth/truth.json       what all of it was made with
//   truth/environment.exr  the light at the probe, latitude-longitude, at time 0
//   truth/plate_linear_0000.exr   frame 0 without noise
//   truth/photograph_0000.exr     the same with the car really there
//   truth/coverage_0000.exr       which share of each pixel the car covers
//
// The same settings write the same bytes. Throws std::runtime_error with path and reason.
DemoFigures write_court_demo(const DemoSettings& settings, const DemoProgress& progress);

}  // namespace studio
