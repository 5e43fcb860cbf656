// Made footage with its truth: plate, probe, set, and the photograph that the composite should
// match.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string_view>
#include <vector>

#include "render/light_table.h"
#include "render/made_studio.h"
#include "render/scene.h"

namespace studio {

// The made worlds: a court under a made sky that a camera on a stand films, and a parking place in
// a park with a real map as its light, which a camera pans over (render/made_park.h).
enum class DemoWorld { court, park };

struct DemoSettings {
  std::filesystem::path dir;
  DemoWorld world = DemoWorld::court;
  std::filesystem::path map;  // of the park: a latitude-longitude picture, .hdr or .exr
  render::MadeStudioSettings studio;
  bool lamp = false;  // of the court: a lamp stands by the car, as virtual as the car is
  int samples = 16;   // paths per pixel and part of the light
};

struct DemoFigures {
  std::filesystem::path set;  // the set file
  int frames = 0;
  int shots = 0;             // of the probe
  double car_share = 0;      // of the plate's pixels, with the lamp
  double ground_share = 0;   // of the plate's pixels: the court, where the car does not hide it
  std::uintmax_t bytes = 0;  // of all files
};

// The lamp's disc is so many lights where it really stands; a set may take fewer.
inline constexpr int lights_of_photographed_lamp = 16;

// Called with the share that is done, 0 to 1, and what comes next.
using DemoProgress = std::function<void(double share, std::string_view what)>;

// The settings that a demo was made with, from its truth.json. Throws std::runtime_error with path
// and reason.
DemoSettings read_demo_truth(const std::filesystem::path& file);

// The plate's height for another width, of the same shape to a pixel or so: even, as H.264 needs.
int height_for(const render::MadeStudioSettings& studio, int width);

// The world without its car. Throws std::runtime_error with path and reason for a map that cannot
// be read or used.
render::MadeStudio make_demo_studio(const DemoSettings& settings);

// The same with the set's virtual objects really there: the car at the origin, and the lamp if
// there is one. `is_virtual` tells their instances from the rest.
render::SceneDescription place_with_objects(const render::MadeStudio& studio,
                                            std::vector<bool>& is_virtual);

// What the lamp sends, as photographs are to be lit by it; nothing if there is none.
std::vector<render::LocalLight> lights_of_lamp(const render::MadeStudio& studio, int count);

// Makes a world with its car. Writes into settings.dir, which is made if it is not there:
//
//   car.toml or park_car.toml   the set
//   plate.mkv              the plate, with a clap at truth.json's clap_s
//   clap.mkv               of the court: the same clap beside a flash in the picture
//   plate.csv              of the park: where the camera was
//   probe/                 the fish-eye's shots and frames.csv
//   scene.cameramodel, probe.toml   the lenses
//   calibration/           of the court: boards, markers and a lamp before both cameras
//                          (demo_calibration.h)
//   truth/truth.json       what all of it was made with
//   truth/environment.exr  the light at the probe, latitude-longitude, at time 0
//   truth/plate_linear_0000.exr   frame 0 without noise
//   truth/photograph_0000.exr     the same with the car (and the lamp) really there
//   truth/photograph_0000.png     and as the camera would have coded it, with noise
//   truth/coverage_0000.exr       which share of each pixel they cover
//
// The same settings write the same bytes. Throws std::runtime_error with path and reason; also
// where the folder holds another set of that name, or a plate of somebody else's.
DemoFigures write_demo(const DemoSettings& settings, const DemoProgress& progress);

}  // namespace studio
