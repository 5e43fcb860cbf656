// The chart of persons from the side.
#include "studio/charts/hull.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <list>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "calibrate/angles.h"
#include "compositing/billboard.h"
#include "compositing/billboard_place.h"
#include "compositing/feet.h"
#include "compositing/key_error.h"
#include "compositing/keyed_picture.h"
#include "compositing/made_walker.h"
#include "compositing/person_shape.h"
#include "compositing/stand_in.h"
#include "compositing/visual_hull.h"
#include "render/renderer.h"
#include "studio/charts/silhouette.h"
#include "studio/display_png.h"

namespace studio {
namespace {

using calibrate::Vec3;
using compositing::BillboardCamera;

using calibrate::degree;
constexpr double distance_m = 4, camera_m = 1.4, look_at_m = 0.9;
// The walker comes towards the middle between the first two cameras, past the set's origin.
constexpr double apart_deg = 60, way_deg = 30;
constexpr double turn_rad = 30 * degree;  // of the billboard, as a set's is that says nothing
constexpr double box_m = 0.6, box_high_m = 1.9;  // about the person: feet are known, limbs are not

Vec3 round_at(double degrees, double radius_m, double z) {
  return {radius_m * std::sin(degrees * degree), -radius_m * std::cos(degrees * degree), z};
}

capture::Image alpha_of(const capture::Image& rgba) {
  capture::Image alpha = capture::make_image(rgba.height, rgba.width, 1);
  for (std::size_t i = 0; i < alpha.pixels.size(); ++i) alpha.pixels[i] = rgba.pixels[i * 4 + 3];
  return alpha;
}

struct Filmed {
  BillboardCamera camera;
  std::shared_ptr<const compositing::KeyedPicture> picture;
  std::array<float, 4> box{};            // of the person, pixels: left, top, right, bottom
  std::vector<calibrate::Vec2> lower{};  // Feet::lower
};

struct Shown {
  capture::Image picture;
  double time_ms = 0;
};

// What a person may be shown as.
struct Method {
  std::string name;
  std::size_t cameras = 1;  // 1 = a billboard
  bool nearest = false;     // the billboard of the camera that is nearest to the view
  bool in_middle = false;   // ... through the body's middle, not the foot that stands
};

class HullChart {
 public:
  HullChart(const ChartRequest& request, Console& console)
      : quick_(request.quick),
        out_(request.out),
        console_(console),
        width_(quick_ ? 96 : 280),
        height_(quick_ ? 120 : 350) {
    compositing::register_shaders();
    const double focal = 1.1 * height_ * distance_m / 2.2;
    lens_ = {"pinhole", width_, height_, {focal, focal, (width_ - 1) / 2.0, (height_ - 1) / 2.0}};
    directions_ = calibrate::make_direction_table(lens_);
    plate_ = compositing::make_new_background(height_, width_);
    half_plate_ = capture::to_half(plate_);
    environment_.radiance = capture::make_image(16, 32, 3);
    render::smooth_for_reflections(environment_);
    const double walked = 1.0;
    walker_.way = round_at(way_deg, 1, 0);
    walker_.start = -walked * walker_.way;
    for (const double gone : {0.7, 0.92, 1.14}) {
      times_.push_back(gone / walker_.speed_m_s);
      if (quick_) break;
    }
    for (double angle = 0; angle <= 90; angle += quick_ ? 30 : 15) angles_.push_back(angle);
  }

  Stressor billboard_views() {
    Stressor s{"view, off the person's camera", "degrees", false, {}};
    s.error_name = "outline of the billboard: error, m";
    const double metres_a_pixel = distance_m / lens_.parameters[0];
    for (const double angle : angles_) {
      if (angle > 75) break;  // seen from the edge, it shows next to nothing
      console_.progress(0.9 + 0.001 * angle, "views of a billboard");
      const Mean mean = mean_at({"", 1}, angle, step_px_, times_.size());
      StressorSample sample{angle, mean.error.silhouette_px * metres_a_pixel,
                            compositing::billboard_error_m(angle * degree, compositing::off_foot_m),
                            angle * degree > turn_rad + 1e-6 ? "shallow" : "ok"};
      sample.figures = {{"composite", mean.error.composite}, {"wrong", mean.error.wrong_share}};
      s.samples.push_back(std::move(sample));
    }
    return s;
  }

  Chart measure() {
    Chart chart;
    chart.stage = "hull";
    chart.title = "A person from the side: billboard and visual hull";
    chart.subtitle = fmt::format(
        "A made walker, {} frames, filmed by cameras of {}x{} at {:g} m; the first two {:g}° "
        "apart, against its true picture. One ray a pixel; processor time of a whole frame.",
        times_.size(), width_, height_, distance_m, apart_deg);
    chart.error_name = "distance in Oklab x100 in the person, mean over views";
    chart.relative = false;
    add_angles(chart);
    add_points(chart);
    chart.panels.push_back({"silhouette: distance, px", {{"silhouette_px", ""}}});
    chart.panels.push_back({"pixels that are wrong, in those of the person", {{"wrong", ""}}});
    if (!out_.empty()) write_strip();
    return chart;
  }

 private:
  // The first stands at 0 degrees; two are apart_deg apart, more go evenly half round the person.
  static std::vector<double> places_of(std::size_t cameras) {
    std::vector<double> places;
    for (std::size_t i = 0; i < cameras; ++i) {
      const double step = cameras == 2 ? apart_deg : 180.0 / static_cast<double>(cameras);
      places.push_back(step * static_cast<double>(i));
    }
    return places;
  }

  calibrate::Pose pose_at(double degrees) const {
    return calibrate::look_at(round_at(degrees, distance_m, camera_m), {0, 0, look_at_m}, 0);
  }

  const Filmed& filmed(double degrees, double time_s) {
    for (const auto& [key, film] : films_) {
      if (key == std::pair(degrees, time_s)) return film;
    }
    Filmed film;
    film.camera = {lens_, pose_at(degrees)};
    const capture::Image rgba =
        photograph_of(lens_, film.camera.cam_from_set, walker_, time_s, quick_ ? 3 : 4);
    film.box = {static_cast<float>(width_), static_cast<float>(height_), 0, 0};
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        if (!(rgba.at(y, x, 3) > 0)) continue;
        const auto fx = static_cast<float>(x), fy = static_cast<float>(y);
        film.box = {std::min(film.box[0], fx - 1), std::min(film.box[1], fy - 1),
                    std::max(film.box[2], fx + 1), std::max(film.box[3], fy + 1)};
      }
    }
    film.lower = compositing::find_feet(alpha_of(rgba)).lower;
    film.picture =
        std::make_shared<compositing::KeyedPicture>(compositing::make_keyed_texture(rgba), true);
    return films_.emplace_back(std::pair(degrees, time_s), std::move(film)).second;
  }

  render::SceneDescription scene_of(const Method& method,
                                    double view_deg,
                                    double time_s,
                                    double step_px,
                                    render::Scene::Pictures& pictures) {
    render::SceneDescription scene;
    scene.background = "plate";
    render::Instance& person = scene.instances.emplace_back();
    person.moves = true;
    const Vec3 body = walker_.start + walker_.speed_m_s * time_s * walker_.way;
    if (method.cameras == 1) {
      const bool second = method.nearest && std::abs(view_deg - apart_deg) < std::abs(view_deg);
      const Filmed& film = filmed(second ? apart_deg : 0, time_s);
      pictures = {film.picture};
      scene.materials = {compositing::make_billboard_material("person", {}, film.camera)};
      scene.meshes = {std::make_shared<render::Mesh>(compositing::make_billboard_mesh(0))};
      const compositing::Lowest foot =
          compositing::lowest_of({lens_, film.camera.cam_from_set, directions_}, walker_, time_s);
      const Vec3 at = method.in_middle ? body : foot.centre;
      // As shows have it: of persons that stand by their feet.
      std::span<const calibrate::Vec2> lower;
      if (!method.in_middle) lower = film.lower;
      const auto place =
          compositing::place_billboard(lens_, film.camera.cam_from_set, {at.x, at.y, 0}, film.box,
                                       round_at(view_deg, distance_m, camera_m), turn_rad, lower);
      if (place) person.set_from_object = place->set_from_object;
      return scene;
    }
    std::vector<compositing::HullView> views;
    for (const double degrees : places_of(method.cameras)) {
      const Filmed& film = filmed(degrees, time_s);
      views.push_back({static_cast<std::uint32_t>(pictures.size()), film.camera});
      pictures.push_back(film.picture);
    }
    scene.materials = {
        compositing::make_hull_material("person", {.step_px = static_cast<float>(step_px)}, views)};
    scene.meshes = {std::make_shared<render::Mesh>(compositing::make_hull_mesh(0))};
    const Vec3 reach{box_m, box_m, 0};
    person.set_from_object =
        compositing::placed_box(calibrate::to_float(body - reach + Vec3{0, 0, 0.001}),
                                calibrate::to_float(body + reach + Vec3{0, 0, box_high_m}));
    return scene;
  }

  // Pictures are filtered as wide as a pixel; more rays would only smooth edges within the person.
  Shown render(
      const Method& method, double view_deg, double time_s, double step_px, int aa_samples = 1) {
    render::Scene::Pictures pictures;
    render::SceneDescription description = scene_of(method, view_deg, time_s, step_px, pictures);
    // As in a show: the person stood elsewhere in the frame before.
    render::SceneDescription elsewhere = description;
    elsewhere.instances[0].set_from_object[3] += 0.01F;
    const render::Scene before(std::move(elsewhere), pictures);
    render::FrameJob job;
    job.cam_from_set = pose_at(view_deg);
    job.effort.aa_samples = aa_samples;
    render::FrameResult result;
    const std::clock_t start = std::clock();
    const render::Scene scene(std::move(description), before, std::move(pictures));
    render_frame({.scene = &scene, .directions = &directions_, .environment = &environment_}, job,
                 half_plate_, result);
    const std::clock_t taken = std::clock() - start;
    return {capture::to_float(result.rgba), 1e3 * static_cast<double>(taken) / CLOCKS_PER_SEC};
  }

  struct Mean {
    PersonError error;
    double time_ms = 0;
  };
  Mean mean_at(const Method& method, double view_deg, double step_px, std::size_t frames) {
    Mean mean;
    const auto share = 1 / static_cast<double>(frames);
    for (std::size_t i = 0; i < frames; ++i) {
      const double t = times_[i];
      const Shown shown = render(method, view_deg, t, step_px);
      const PersonError e = person_error(shown.picture, truth(view_deg, t), plate_);
      mean.error.composite += share * e.composite;
      mean.error.silhouette_px += share * e.silhouette_px;
      mean.error.wrong_share += share * e.wrong_share;
      mean.time_ms += share * shown.time_ms;
    }
    return mean;
  }

  const capture::Image& truth(double view_deg, double time_s) {
    for (const auto& [key, image] : truths_) {
      if (key == std::pair(view_deg, time_s)) return image;
    }
    return truths_
        .emplace_back(std::pair(view_deg, time_s),
                      photograph_of(lens_, pose_at(view_deg), walker_, time_s, quick_ ? 3 : 4))
        .second;
  }

  void add_angles(Chart& chart) {
    const std::vector<Method> methods = {{"hull of 2 cameras", 2},
                                         {"billboard, by the foot", 1},
                                         {"billboard, by the body", 1, false, true},
                                         {"nearer camera's billboard, by the body", 1, true, true},
                                         {"hull of 3 cameras", 3},
                                         {"hull of 4 cameras", 4}};
    struct Kind {
      const char *name, *figure;
      double PersonError::*member;
    };
    const std::vector<Kind> kinds = {
        {"distance in Oklab x100 in the person", "composite", &PersonError::composite},
        {"silhouette: distance, px", "silhouette", &PersonError::silhouette_px},
        {"pixels that are wrong, in those of the person", "wrong", &PersonError::wrong_share}};
    std::vector<Stressor> stressors;
    for (const Kind& kind : kinds) {
      Stressor s{"view, off the first camera", "degrees", false, {}};
      s.error_name = kind.name;
      s.own_name = methods[0].name;
      for (std::size_t m = 1; m < methods.size(); ++m) {
        s.beside.emplace_back(fmt::format("{}_{}", kind.figure, m), methods[m].name);
      }
      for (const double angle : angles_) s.samples.push_back({angle, 0, std::nullopt, "ok"});
      stressors.push_back(std::move(s));
    }
    for (std::size_t m = 0; m < methods.size(); ++m) {
      for (std::size_t a = 0; a < angles_.size(); ++a) {
        console_.progress(0.7 * static_cast<double>(m * angles_.size() + a) /
                              static_cast<double>(methods.size() * angles_.size()),
                          methods[m].name);
        const Mean mean = mean_at(methods[m], angles_[a], step_px_, times_.size());
        for (std::size_t k = 0; k < kinds.size(); ++k) {
          StressorSample& sample = stressors[k].samples[a];
          const double value = mean.error.*kinds[k].member;
          if (m == 0) sample.error = value;
          if (m > 0) sample.figures.emplace_back(stressors[k].beside[m - 1].first, value);
        }
      }
    }
    for (Stressor& s : stressors) chart.stressors.push_back(std::move(s));
  }

  void add_points(Chart& chart) {
    const std::vector<double> views = quick_ ? std::vector{30.0} : std::vector{15.0, 30.0};
    const auto add = [&](const Method& method, double step_px) {
      console_.progress(0.7 + 0.02 * static_cast<double>(chart.points.size()), method.name);
      ChartPoint point;
      point.method = method.name;
      point.by_default = method.cameras == 2 && step_px == step_px_;
      if (method.cameras > 1) {
        point.settings = {{"step_px", step_px}};
        point.label = fmt::format("{:g} px", step_px);
      }
      PersonError sum;
      const auto share = 1 / static_cast<double>(views.size());
      for (const double view : views) {
        const Mean mean = mean_at(method, view, step_px, times_.size());
        point.error += share * mean.error.composite;
        sum.silhouette_px += share * mean.error.silhouette_px;
        sum.wrong_share += share * mean.error.wrong_share;
        point.time_ms += share * mean.time_ms;
      }
      point.figures = {{"silhouette_px", sum.silhouette_px}, {"wrong", sum.wrong_share}};
      chart.points.push_back(std::move(point));
    };
    add({"billboard, by the foot", 1}, 1);
    add({"billboard, by the body", 1, false, true}, 1);
    const std::vector<double> steps =
        quick_ ? std::vector{1.5, 6.0} : std::vector{0.5, 1.5, 3.0, 6.0, 12.0};
    for (const std::size_t cameras : {2U, 3U, 4U}) {
      for (const double step : steps)
        add({fmt::format("hull of {} cameras", cameras), cameras}, step);
    }
  }

  // Rows of views: truth, billboard, hulls of two and of four cameras.
  void write_strip() {
    constexpr int whole = render::Effort{}.aa_samples;
    const std::vector<double> views = {0, 15, 30, 60};
    const double t = times_[std::min<std::size_t>(1, times_.size() - 1)];
    capture::Image strip =
        capture::make_image(static_cast<int>(views.size()) * height_, 4 * width_, 4);
    const auto put = [&](int row, int column, const capture::Image& image) {
      for (int y = 0; y < height_; ++y) {
        for (int x = 0; x < width_; ++x) {
          for (int c = 0; c < 3; ++c) {
            strip.at(row * height_ + y, column * width_ + x, c) = image.at(y, x, c);
          }
          strip.at(row * height_ + y, column * width_ + x, 3) = 1;
        }
      }
    };
    for (std::size_t i = 0; i < views.size(); ++i) {
      const int row = static_cast<int>(i);
      capture::Image true_one = plate_;
      const capture::Image& person = truth(views[i], t);
      for (int y = 0; y < height_; ++y) {
        for (int x = 0; x < width_; ++x) {
          for (int c = 0; c < 3; ++c) {
            true_one.at(y, x, c) =
                person.at(y, x, c) + (1 - person.at(y, x, 3)) * plate_.at(y, x, c);
          }
        }
      }
      put(row, 0, true_one);
      put(row, 1, render({"", 1}, views[i], t, step_px_, whole).picture);
      put(row, 2, render({"", 2}, views[i], t, step_px_, whole).picture);
      put(row, 3, render({"", 4}, views[i], t, step_px_, whole).picture);
    }
    std::filesystem::create_directories(out_);
    write_display_png((std::filesystem::path(out_) / "hull_views.png").string(), strip);
  }

  bool quick_;
  std::string out_;
  Console& console_;
  int width_, height_;
  double step_px_ = double{compositing::HullSettings{}.step_px};
  calibrate::Lens lens_;
  calibrate::DirectionTable directions_;
  capture::Image plate_;
  capture::HalfImage half_plate_;
  render::Environment environment_;
  compositing::MadeWalker walker_;
  std::vector<double> times_, angles_;
  using Key = std::pair<double, double>;  // degrees, seconds
  std::list<std::pair<Key, Filmed>> films_;
  std::list<std::pair<Key, capture::Image>> truths_;
};

}  // namespace

Stressor billboard_view_stressor(bool quick, Console& console) {
  ChartRequest request;
  request.quick = quick;
  return HullChart(request, console).billboard_views();
}

ChartStage hull_chart() {
  return {"hull", "a person seen from the side, as a billboard and as a visual hull",
          [](const ChartRequest& request, Console& console) {
            return HullChart(request, console).measure();
          }};
}

}  // namespace studio
