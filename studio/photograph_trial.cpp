// Truths of made worlds, and composites with them.
#include "studio/photograph_trial.h"

#include <chrono>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "render/light_follower.h"
#include "render/made_studio.h"
#include "render/reference.h"

namespace studio {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t first_seed = 1001;  // none that footage is made with

capture::Image mean_of(const capture::Image& a, const capture::Image& b) {
  capture::Image mean = a;
  for (std::size_t i = 0; i < mean.pixels.size(); ++i) {
    mean.pixels[i] = 0.5F * (a.pixels[i] + b.pixels[i]);
  }
  return mean;
}

// Turned so that what the camera sees moves left and up by so many pixels at the picture's middle.
calibrate::Pose turned(const calibrate::Pose& cam_from_set,
                       const calibrate::DirectionTable& directions,
                       double error_px) {
  const int y = directions.height / 2;
  const int x = directions.width / 2;
  const auto at = [&](int row, int column) {
    const std::size_t i = directions.index(row, column);
    return calibrate::Vec3{directions.x[i], directions.y[i], directions.z[i]};
  };
  const double right_rad = error_px * length(at(y, x + 1) - at(y, x));
  const double down_rad = error_px * length(at(y + 1, x) - at(y, x));
  const calibrate::Vec3 ahead{std::sin(right_rad), std::sin(down_rad) * std::cos(right_rad),
                              std::cos(down_rad) * std::cos(right_rad)};
  const calibrate::Vec3 right = normalize(cross(calibrate::Vec3{0, 1, 0}, ahead));
  const calibrate::Vec3 down = cross(ahead, right);
  const calibrate::Mat3 turn{
      {right.x, right.y, right.z, down.x, down.y, down.z, ahead.x, ahead.y, ahead.z}};
  return calibrate::Pose{turn, {}} * cam_from_set;
}

// The folder of a demo's truth, found by the plate that the set shows.
fs::path truth_of(const Set& set) {
  const std::string& source = set.camera.source;
  const std::size_t colon = source.find(':');
  const fs::path plate = colon == std::string::npos ? source : source.substr(colon + 1);
  const fs::path truth = plate.parent_path() / "truth";
  if (fs::exists(truth / "truth.json")) return truth;
  throw std::runtime_error(set.path + ": " + (truth / "truth.json").string() +
                           " is not there: only sets that \"platelight demo\" wrote have a "
                           "photograph to be compared with");
}

}  // namespace

std::vector<double> parts_of_square(const std::vector<double>& squares) {
  if (squares.empty() || !(squares.front() > 0)) {
    throw std::invalid_argument("only an error can be split into its parts");
  }
  std::vector<double> parts;
  for (std::size_t i = 1; i < squares.size(); ++i) {
    parts.push_back((squares[i - 1] - squares[i]) / squares.front());
  }
  return parts;
}

PhotographTrial::PhotographTrial(const std::string& set_file,
                                 const TrialSettings& settings,
                                 const DemoProgress& progress)
    : settings_(settings) {
  const Set set = read_set(set_file);
  const DemoSettings demo = read_demo_truth(truth_of(set) / "truth.json");
  frame_ = FrameMaker(set).make(0).value();
  plate_ = capture::to_float(*frame_.plate);

  progress(0, "the place");
  const render::MadeStudio studio = make_demo_studio(demo);
  std::vector<bool> is_virtual;
  render::SceneDescription with_objects = place_with_objects(studio, is_virtual);
  for (std::size_t i = 0; i < is_virtual.size(); ++i) {
    if (!is_virtual[i]) with_objects.instances[i].kind = render::ObjectKind::stand_in;
  }
  const render::Scene place(studio.place);
  const render::Scene scene(with_objects);
  const calibrate::Pose& pose = studio.plate.cam_from_set;
  const float strength = render::sun_strength(studio, render::time_of_picture(studio.plate, 0));
  std::uint32_t seed = first_seed;
  double done = 0.05;
  const std::vector<render::LocalLight> lamp = lights_of_lamp(studio, lights_of_photographed_lamp);
  const auto take = [&](const render::Scene& seen, bool with_lamp, bool behind_virtual) {
    progress(done += 0.13, "photographs");
    render::PhotographSettings paths{
        .samples = settings_.photograph_samples, .seed = seed++, .behind_virtual = behind_virtual};
    if (with_lamp) paths.lamps = lamp;
    return add_light(photograph_parts(studio, seen, *frame_.directions, pose, paths), strength);
  };
  const auto take_twice = [&](const render::Scene& seen, bool with_lamp, bool behind_virtual) {
    Twice twice;
    twice.first = take(seen, with_lamp, behind_virtual);
    twice.second = take(seen, with_lamp, behind_virtual);
    return twice;
  };
  photographs_ = take_twice(scene, true, false);
  plates_ = take_twice(place, false, false);
  behind_ = take_twice(scene, true, true);
  photograph_ = mean_of(photographs_.first, photographs_.second);

  progress(0.9, "the light");
  const calibrate::Pose at_probe{{}, -calibrate::position_of(studio.probe.cam_from_set)};
  true_light_.radiance = add_light(
      photograph_parts(studio, place, render::latlong_directions(demo.studio.sky_height), at_probe,
                       {.samples = settings.photograph_samples, .seed = seed++}),
      strength);
  true_light_.seen.assign(true_light_.radiance.pixels.size() / 3, 1);
  render::LightFollower follower;
  render::LightFollowerSettings following;
  following.table.count = frame_.job.effort.light_samples;
  true_table_ = follower.follow(true_light_, following);
  smooth_for_reflections(true_light_, follower.compact_texels());
  true_table_.lamps = frame_.job.lights.lamps;

  progress(0.95, "the matte");
  coverage_ = render::coverage_of(with_objects, is_virtual, *frame_.directions, pose,
                                  4 * settings.photograph_samples);
  mask_ = render::affected_mask(
      render({.light = true, .sampling = true}, 0, plates_.first, first_seed), plates_.first);
}

double PhotographTrial::affected_share() const {
  double sum = 0;
  for (const float affected : mask_.pixels) sum += affected;
  return sum / static_cast<double>(mask_.pixels.size());
}

std::size_t PhotographTrial::triangles() const {
  return render::triangle_count(frame_.scene->description());
}

capture::Image PhotographTrial::render(const Truths& truths,
                                       double calibration_error_px,
                                       const capture::Image& plate,
                                       std::uint32_t seed) const {
  render::FrameJob job = frame_.job;
  render::FrameInputs inputs = frame_.inputs();
  if (truths.light) {
    inputs.environment = inputs.planned = &true_light_;
    job.lights = true_table_;
  }
  if (!truths.calibration) {
    job.cam_from_set = turned(job.cam_from_set, *inputs.directions, calibration_error_px);
  }
  if (truths.sampling) {
    render::ReferenceSettings reference;
    reference.samples = settings_.reference_samples;
    reference.seed = seed;
    reference.bounces = truths.bounces;
    return render_reference(inputs, job, plate, reference);
  }
  render::FrameResult result;
  render_frame(inputs, job, capture::to_half(plate), result);
  return capture::to_float(result.rgba);
}

capture::Image PhotographTrial::compose(const Truths& truths,
                                        double calibration_error_px,
                                        bool first) const {
  if (truths.bounces && !truths.sampling) {
    throw std::invalid_argument("only the reference follows light between surfaces");
  }
  const std::uint32_t seed = first_seed + (first ? 0 : 1);
  const capture::Image& plate = !truths.plate ? plate_ : first ? plates_.first : plates_.second;
  // Over black, what comes out is the car's own light.
  const capture::Image black = capture::make_image(plate.height, plate.width);
  const capture::Image rgba =
      render(truths, calibration_error_px, truths.matte ? black : plate, seed);
  const capture::Image& behind = first ? behind_.first : behind_.second;
  const capture::Image& bare = first ? plates_.first : plates_.second;
  capture::Image picture = capture::make_image(plate.height, plate.width);
  for (std::size_t i = 0; i < coverage_.pixels.size(); ++i) {
    const float covered = coverage_.pixels[i];
    const float had = rgba.pixels[4 * i + 3];
    for (std::size_t c = 0; c < 3; ++c) {
      float& value = picture.pixels[3 * i + c];
      value = rgba.pixels[4 * i + c];
      if (!truths.matte) continue;
      // The plate in its real shadow.
      const float lit = bare.pixels[3 * i + c];
      const float shaded = lit > 0 ? behind.pixels[3 * i + c] / lit : 1.0F;
      value = (had > 0 ? value / had * covered : 0.0F) +
              (1 - covered) * shaded * plate.pixels[3 * i + c];
    }
  }
  return picture;
}

capture::Image PhotographTrial::composite(const Truths& truths, double calibration_error_px) const {
  return compose(truths, calibration_error_px, true);
}

TrialResult PhotographTrial::measure(const Truths& truths, double calibration_error_px) const {
  TrialResult result;
  const auto start = std::chrono::steady_clock::now();
  const capture::Image first = compose(truths, calibration_error_px, true);
  result.time_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  const bool noisy = truths.plate || truths.matte || truths.sampling;
  const capture::Image second =
      noisy ? compose(truths, calibration_error_px, false) : capture::Image{};
  result.error = render::paired_error({&first, noisy ? &second : &first},
                                      {&photographs_.first, &photographs_.second}, mask_);
  result.error_p99 = render::picture_error(first, photograph_, mask_).p99;
  return result;
}

}  // namespace studio
