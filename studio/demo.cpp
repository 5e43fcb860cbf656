// The order in which made footage is made.
#include "studio/demo.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "calibrate/angles.h"
#include "calibrate/lens.h"
#include "capture/camera.h"
#include "capture/exr.h"
#include "render/join_scenes.h"
#include "render/made_car.h"
#include "render/made_lamp.h"
#include "render/made_park.h"
#include "studio/demo_calibration.h"
#include "studio/demo_files.h"

namespace studio {
namespace {

namespace fs = std::filesystem;

render::Placement placement_of(const render::MadeStand& stand) {
  using calibrate::degree;
  return render::placed(stand.foot, static_cast<float>(stand.yaw_deg * degree));
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

int height_for(const render::MadeStudioSettings& studio, int width) {
  return 2 * ((width * studio.height + studio.width) / (2 * studio.width));
}

render::MadeStudio make_demo_studio(const DemoSettings& settings) {
  if (settings.world == DemoWorld::court) {
    render::MadeStudio studio = render::make_studio(settings.studio);
    if (settings.lamp) studio.lamp = {render::court_lamp_foot, render::court_lamp_yaw_deg};
    return studio;
  }
  if (settings.lamp) throw std::invalid_argument("only the court has a lamp");
  const std::string map = settings.map.string();
  const auto picture = capture::open_camera("file:" + map)->next();
  if (!picture || !picture->image) throw std::runtime_error(map + ": holds no picture");
  try {
    return render::make_park(*picture->image, settings.studio);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(map + ": cannot light the park: " + error.what());
  }
}

render::SceneDescription place_with_objects(const render::MadeStudio& studio,
                                            std::vector<bool>& is_virtual) {
  render::SceneDescription scene = studio.place;
  is_virtual.assign(scene.instances.size(), false);
  render::join(scene, render::made_car(), placement_of({{}, studio.car_yaw_deg}));
  if (studio.lamp) render::join(scene, render::made_lamp(), placement_of(*studio.lamp));
  is_virtual.resize(scene.instances.size(), true);
  return scene;
}

std::vector<render::LocalLight> lights_of_lamp(const render::MadeStudio& studio, int count) {
  if (!studio.lamp) return {};
  return render::lights_of_made_lamp(placement_of(*studio.lamp), count);
}

// The set of a folder may have been worked on, and its footage be somebody else's.
void require_no_other_set(const fs::path& set, const std::string& text) {
  const fs::path plate = set.parent_path() / "plate.mkv";
  if (!fs::exists(set)) {
    // Beside its truth, it is left of a demo that was not finished.
    if (!fs::exists(plate) || fs::exists(set.parent_path() / "truth")) return;
    throw std::runtime_error(plate.string() + " is there already: name another folder");
  }
  std::ifstream file(set, std::ios::binary);
  if (std::string{std::istreambuf_iterator<char>(file), {}} == text) return;
  throw std::runtime_error(set.string() +
                           " is there already, and is another set than the one to be made: name "
                           "another folder, or move it away");
}

DemoFigures write_demo(const DemoSettings& settings, const DemoProgress& progress) {
  DemoFigures figures;
  figures.frames = settings.studio.frames;

  progress(0, "the place");
  const render::MadeStudio studio = make_demo_studio(settings);
  const bool court = settings.world == DemoWorld::court;
  figures.set = settings.dir / (court ? "car.toml" : "park_car.toml");
  const std::string set_text = court ? court_set(studio, "") : park_set(studio, "");
  require_no_other_set(figures.set, set_text);
  const fs::path truth = settings.dir / "truth";
  fs::create_directories(truth);
  const render::Scene place(studio.place);
  const auto plate_directions = calibrate::make_direction_table(studio.plate.lens);
  const std::vector<render::LocalLight> lamp = lights_of_lamp(studio, lights_of_photographed_lamp);
  const auto photograph = [&](const render::Scene& scene, int n,
                              std::span<const render::LocalLight> lamps = {}) {
    // Frame 0 has a truth to be compared with; the others' noise need only stay below the sensor's.
    const int samples = n == 0 ? settings.samples : (settings.samples + 1) / 2;
    return render::photograph_parts(studio, scene, plate_directions,
                                    render::pose_of_picture(studio.plate, n),
                                    {.samples = samples,
                                     .seed = studio.settings.seed + static_cast<std::uint32_t>(n),
                                     .lamps = lamps});
  };
  const auto strength_at = [&](int n) {
    return render::sun_strength(studio, render::time_of_picture(studio.plate, n));
  };

  progress(0.05, "the plate");
  const render::LightParts first = photograph(place, 0);
  const capture::Image first_radiance = render::add_light(first, strength_at(0));
  capture::write_exr((truth / "plate_linear_0000.exr").string(), first_radiance);
  const bool moves = !studio.plate.track.keys.empty();
  write_demo_plate(settings.dir / "plate.mkv", studio, [&](int n) {
    return render::add_light(moves && n > 0 ? photograph(place, n) : first, strength_at(n));
  });
  if (court) write_demo_clap(settings.dir / "clap.mkv", studio, first_radiance);

  progress(0.5, "the probe");
  const calibrate::Pose& probe_pose = studio.probe.cam_from_set;
  const render::LightParts probe = render::photograph_parts(
      studio, place, calibrate::make_direction_table(studio.probe.lens), probe_pose,
      {.samples = settings.samples, .seed = studio.settings.seed});
  figures.shots = write_demo_probe(settings.dir / "probe", studio, probe);
  const calibrate::Pose unturned{{}, -calibrate::position_of(probe_pose)};
  const render::LightParts around = render::photograph_parts(
      studio, place, render::latlong_directions(settings.studio.sky_height), unturned,
      {.samples = std::max(1, settings.samples / 4), .seed = studio.settings.seed});
  capture::write_exr((truth / "environment.exr").string(),
                     render::add_light(around, strength_at(0)));
  write_demo_cameras(settings.dir, studio);
  if (court) {
    progress(0.58, "calibration");
    write_demo_calibration(settings.dir / "calibration", studio,
                           {first_radiance, render::add_light(probe, strength_at(0))});
  }
  write_text(figures.set, set_text);
  write_demo_truth(truth / "truth.json", settings, studio);

  progress(0.6, "the photograph");
  std::vector<bool> is_virtual;
  const render::SceneDescription with_objects = place_with_objects(studio, is_virtual);
  {
    const render::Scene scene(with_objects);
    const capture::Image radiance = render::add_light(photograph(scene, 0, lamp), strength_at(0));
    capture::write_exr((truth / "photograph_0000.exr").string(), radiance);
    write_demo_picture(truth / "photograph_0000.png", studio, radiance, 0);
  }
  const auto coverage = [&](const std::vector<bool>& seen) {
    return render::coverage_of(with_objects, seen, plate_directions, studio.plate.cam_from_set,
                               settings.samples);
  };
  const capture::Image covered = coverage(is_virtual);
  capture::write_exr((truth / "coverage_0000.exr").string(), covered);
  figures.car_share = mean_of(covered);
  std::vector<bool> is_ground(is_virtual.size(), false);
  is_ground.front() = true;
  figures.ground_share = mean_of(coverage(is_ground));
  figures.bytes = bytes_in(settings.dir);
  progress(1, "done");
  return figures;
}

}  // namespace studio
