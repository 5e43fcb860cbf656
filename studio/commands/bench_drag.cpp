// platelight bench drag: a part of each scene is dragged, then left alone, as on air.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/median.h"
#include "render/kernel.h"
#include "studio/arguments.h"
#include "studio/commands/bench_rows.h"
#include "studio/commands/benches.h"
#include "studio/display_png.h"
#include "studio/paper_shot.h"
#include "studio/sharpening.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;

constexpr capture::Rational rate{25, 1};
constexpr int dragged = 25, waited = 250;  // frames; less if the picture is sharp before

struct Drag {
  const char* scene;
  const char* part;          // its name's beginning
  std::array<float, 3> way;  // metres that it is dragged by
  int width = 640, height = 480;
};
constexpr Drag drags[] = {{"headlight", "bulb", {0.15F, 0, 0}},
                          {"headlight", "bulb", {0.15F, 0, 0}, 320, 240},
                          {"glass_sphere", "glass sphere", {0.2F, 0, 0}},
                          {"tv_room", "vase", {0.25F, 0, 0}},
                          {"car", "wheel front left", {0, 0.3F, 0}}};

// The scene's frames one after the other, each as soon as the one before is done.
class Dragging {
 public:
  // `pictures`: a directory for the last picture of the drag, and that of a second later, or none.
  Dragging(const Drag& drag, std::string pictures)
      : drag_(drag),
        pictures_(std::move(pictures)),
        shot_(make_paper_shot(drag.scene, drag.width, drag.height).shot),
        scene_(shot_.scene->description()),
        still_(scene_) {
    for (render::Instance& instance : scene_.instances) {
      instance.moves = instance.name.starts_with(drag.part);
    }
    shot_.scene = std::make_unique<render::Scene>(scene_);
  }

  Json run() {
    wait(waited);
    const capture::HalfImage before = result_.rgba;
    std::vector<double> ms;
    double lost = 0;
    int first_changed = -1;
    for (int i = 1; i <= dragged; ++i) {
      move(static_cast<float>(i) / dragged);
      ms.push_back(show());
      lost += lost_;
      if (first_changed < 0 && result_.rgba.pixels != before.pixels) first_changed = i;
    }
    const double drag_ms = capture::median_in_place(ms);
    write_picture("dragged", capture::to_float(result_.rgba));
    const capture::Image after_1_s = wait(waited);
    write_picture("a_second_later", after_1_s);
    const double a_second_later = error_of(after_1_s);
    return {{"scene", drag_.scene},
            {"part", drag_.part},
            {"width", drag_.width},
            {"height", drag_.height},
            {"first_changed_frame", first_changed},
            {"cells_anew", lost / dragged},
            {"drag_fps", 1000 / drag_ms},
            {"anti_aliased_after_s", anti_aliased_after_s_},
            {"sharp_after_s", sharp_after_s_},
            {"sharpness_after_1_s", sharpness_after_1_s_},
            {"error_after_1_s", a_second_later}};
  }

 private:
  void move(float share) {
    for (std::size_t i = 0; i < scene_.instances.size(); ++i) {
      if (!scene_.instances[i].moves) continue;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        scene_.instances[i].set_from_object[4 * axis + 3] =
            still_.instances[i].set_from_object[4 * axis + 3] + share * drag_.way[axis];
      }
    }
    shot_.scene = std::make_unique<render::Scene>(scene_, *shot_.scene);
  }

  void write_picture(const char* when, const capture::Image& rgba) const {
    if (pictures_.empty() || rgba.pixels.empty()) return;
    write_display_png(fmt::format("{}/{}_{}_{}.png", pictures_, drag_.scene, drag_.width, when),
                      rgba);
  }

  double show() {
    render::FrameJob job = shot_.job;
    render::FrameInputs inputs = shot_.inputs();
    inputs.kept = &kept_;
    const auto start = std::chrono::steady_clock::now();
    render_sharpening(sharpening_, inputs, job, shot_.half_plate, result_);
    lost_ = sharpening_.lost_share();
    coarsest_ = *std::ranges::min_element(job.stages);
    const std::chrono::duration<double, std::milli> ms = std::chrono::steady_clock::now() - start;
    return ms.count();
  }

  // Until the picture is sharp, or for so many frames. Returns what is shown a second of the clock
  // after the last move, if it takes as long.
  capture::Image wait(int frames) {
    double passed_ms = 0;
    capture::Image after_1_s;
    sharp_after_s_ = anti_aliased_after_s_ = -1;
    sharpness_after_1_s_ = 1;
    for (int i = 0; i < frames && sharp_after_s_ < 0; ++i) {
      passed_ms += std::max(show(), 1000 / rate.value());
      if (passed_ms >= 1000 && after_1_s.pixels.empty()) {
        after_1_s = capture::to_float(result_.rgba);
        sharpness_after_1_s_ = sharpening_.share();
      }
      if (anti_aliased_after_s_ < 0 && coarsest_ >= render::smoothed_stage) {
        anti_aliased_after_s_ = passed_ms * 1e-3;
      }
      if (sharpening_.share() == 1) sharp_after_s_ = passed_ms * 1e-3;
    }
    return after_1_s;
  }

  // Against the finished picture; none if that is what was shown before a second was over.
  double error_of(const capture::Image& shown) {
    if (shown.pixels.empty()) return 0;
    if (sharp_after_s_ < 0) {
      render::render_frame(shot_.inputs(), shot_.job, shot_.half_plate, result_);
    }
    const capture::Image finished = capture::to_float(result_.rgba);
    const capture::Image mask = render::affected_mask(finished, shot_.plate);
    return render::picture_error(shown, finished, mask).relative_rms;
  }

  Drag drag_;
  std::string pictures_;
  BenchScene shot_;
  render::SceneDescription scene_, still_;
  render::KeptTransport kept_;
  Sharpening sharpening_{rate, true};
  render::FrameResult result_;
  int coarsest_ = 0;  // stage of the last frame's cells
  double lost_ = 0, anti_aliased_after_s_ = -1, sharp_after_s_ = -1, sharpness_after_1_s_ = 1;
};

}  // namespace

void bench_drag(const std::string& only, const std::string& pictures, Console& console) {
  if (!only.empty() &&
      std::ranges::none_of(drags, [&](const Drag& d) { return only == d.scene; })) {
    std::string known;
    for (const Drag& drag : drags) {
      if (known.find(drag.scene) != std::string::npos) continue;
      known += fmt::format("{}{}", known.empty() ? "" : ", ", drag.scene);
    }
    throw UsageError(
        fmt::format("nothing is dragged in a scene \"{}\": there are {}", only, known));
  }
  if (!pictures.empty()) std::filesystem::create_directories(pictures);
  Json rows = Json::array();
  console.say(
      "scene          dragged           size     first changed  cells anew   fps   anti-aliased   "
      "finished after   error after 1 s");
  const auto seconds = [](double s) { return s < 0 ? "not" : fmt::format("{:.1f} s", s); };
  for (const Drag& drag : drags) {
    if (!only.empty() && only != drag.scene) continue;
    const Json row = Dragging(drag, pictures).run();
    console.say(fmt::format("{:14} {:17} {}x{} {:>13} {:9.0f} % {:6.1f} {:>14} {:>16} {:15.1f} %",
                            drag.scene, drag.part, drag.width, drag.height,
                            row["first_changed_frame"].get<int>(),
                            100 * row["cells_anew"].get<double>(), row["drag_fps"].get<double>(),
                            seconds(row["anti_aliased_after_s"]), seconds(row["sharp_after_s"]),
                            100 * row["error_after_1_s"].get<double>()));
    rows.push_back(row);
  }
  give_rows(rows, console);
}

}  // namespace studio
