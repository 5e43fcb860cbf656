// The order in which made footage is made.
#include "studio/demo.h"

#include <algorithm>
#include <numbers>
#include <numeric>
#include <vector>

#include "calibrate/lens.h"
#include "capture/exr.h"
#include "render/join_scenes.h"
#include "render/made_car.h"
#include "studio/demo_files.h"

namespace studio {
namespace {

namespace fs = std::filesystem;

// The court with the car really at its origin. `is_car` tells the car's parts from the rest.
render::SceneDescription court_with_car(const render::MadeStudio& studio,
                                        std::vector<bool>& is_car) {
  constexpr double degree = std::numbers::pi / 180;
  render::SceneDescription scene = studio.court;
  is_car.assign(scene.instances.size(), false);
  render::join(scene, render::made_car(),
               render::placed({}, static_cast<float>(render::court_car_yaw_deg * degree)));
  is_car.resize(scene.instances.size(), true);
  return scene;
}

double mean_of(const capture::Image& image) {
  return std::accumulate(image.pixels.begin(), image.pixels.end(), 0.0) /
         static_cast<double>(image.pixels.size());
}

std::uintmax_t bytes_in(const fs::path& dir) {
  std::uintmax_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(dir)) {
    if (entry.is_regular_file()) bytes += entry.file_size();
  }
  return bytes;
}

}  // namespace

DemoFigures write_court_demo(const DemoSettings& settings, const DemoProgress& progress) {
  const fs::path truth = settings.dir / "truth";
  fs::create_directories(truth);
  DemoFigures figures;
  figures.frames = settings.studio.frames;

  progress(0, "the court");
  const render::MadeStudio studio = render::make_studio(settings.studio);
  const render::Scene court(studio.court);
  const auto plate_directions = calibrate::make_direction_table(studio.plate.lens);
  const calibrate::Pose& plate_pose = studio.plate.cam_from_set;

  progress(0.08, "the plate");
  const render::LightParts plate =
      render::photograph_parts(studio, court, plate_directions, plate_pose, settings.samples);
  const float strength = render::sun_strength(studio, render::time_of_picture(studio.plate, 0));
  capture::write_exr((truth / "plate_linear_0000.exr").string(),
                     render::add_light(plate, strength));
  write_demo_plate(settings.dir / "plate.mkv", studio, plate);
  write_demo_clap(settings.dir / "clap.mkv", studio, plate);

  progress(0.5, "the probe");
  const calibrate::Pose& probe_pose = studio.probe.cam_from_set;
  const render::LightParts probe =
      render::photograph_parts(studio, court, calibrate::make_direction_table(studio.probe.lens),
                               probe_pose, settings.samples);
  figures.shots = write_demo_probe(settings.dir / "probe", studio, probe);
  const calibrate::Pose unturned{{}, -calibrate::position_of(probe_pose)};
  const render::LightParts around = render::photograph_parts(
      studio, court, render::latlong_directions(settings.studio.sky_height), unturned,
      std::max(1, settings.samples / 4));
  capture::write_exr((truth / "environment.exr").string(), render::add_light(around, strength));
  write_demo_set(settings.dir, studio);
  write_demo_truth(truth / "truth.json", studio, settings.samples);

  progress(0.6, "the photograph");
  std::vector<bool> is_car;
  const render::SceneDescription with_car = court_with_car(studio, is_car);
  {
    const render::Scene scene(with_car);
    const render::LightParts photograph =
        render::photograph_parts(studio, scene, plate_directions, plate_pose, settings.samples);
    capture::write_exr((truth / "photograph_0000.exr").string(),
                       render::add_light(photograph, strength));
  }
  const auto coverage = [&](const std::vector<bool>& seen) {
    return render::coverage_of(with_car, seen, plate_directions, plate_pose, settings.samples);
  };
  const capture::Image car = coverage(is_car);
  capture::write_exr((truth / "coverage_0000.exr").string(), car);
  figures.car_share = mean_of(car);
  std::vector<bool> is_ground(is_car.size(), false);
  is_ground.front() = true;
  figures.ground_share = mean_of(coverage(is_ground));
  figures.bytes = bytes_in(settings.dir);
  progress(1, "done");
  return figures;
}

}  // namespace studio
