// The made set in words: set file, lenses, truth.
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "capture/files.h"
#include "studio/demo_files.h"

namespace studio {
namespace {

namespace fs = std::filesystem;

void write_text(const fs::path& file, const std::string& text) {
  capture::write_file(file.string(), std::as_bytes(std::span(text)));
}

// Nine digits: what is left out is far below a pixel.
std::string number(double value) { return fmt::format("{:.9g}", value + 0.0); }

std::string numbers(calibrate::Vec3 v) {
  return fmt::format("[{}, {}, {}]", number(v.x), number(v.y), number(v.z));
}

// The nine numbers of a set file's rotation.
std::string rotation(const calibrate::Pose& pose) {
  std::string list = "[";
  for (const double entry : pose.R.m) {
    if (list.size() > 1) list += ", ";
    list += number(entry);
  }
  return list + "]";
}

}  // namespace

void write_demo_set(const fs::path& dir, const render::MadeStudio& studio) {
  calibrate::write_lens((dir / "scene.cameramodel").string(), studio.plate.lens);
  calibrate::write_lens((dir / "probe.toml").string(), studio.probe.lens);
  const auto& card = render::court_card;
  const auto patch = render::picture_of_card(studio);
  const auto& crate = render::court_crate;
  constexpr double degrees_per_rad = 57.29577951308232;
  std::string text = "# A made car on a made court. truth/ holds what a camera would have seen.\n";
  text += fmt::format(
      "name = \"made car on the court\"\n\n"
      "[show]\nwidth = {}\nheight = {}\nfps = {}\n\n"
      "[camera]\nsource = \"file:plate.mkv\"\nlens = \"scene.cameramodel\"\n"
      "pose = {{ position = {}, rotation = {} }}\n"
      "colour = \"{}\"\nexposure_s = {}\n\n",
      studio.plate.lens.width, studio.plate.lens.height, studio.plate.rate.num,
      numbers(calibrate::position_of(studio.plate.cam_from_set)),
      rotation(studio.plate.cam_from_set), capture::name_of(studio.plate.sensor.transfer),
      studio.plate.exposures_s.front());
  text += fmt::format(
      "[probe]\nsource = \"replay:probe\"\nlens = \"probe.toml\"\n"
      "pose = {{ position = {}, axis = [0, 0, 1] }}\n"
      "colour = \"{}\"\nexposures = \"auto\"\n"
      "offset_s = {:.9f}  # the recording of the probe began so much before the plate\n"
      "unseen = \"floor\"\n"
      "match = {{ patch = [{}, {}, {}, {}], albedo = {} }}  # a grey card on the ground\n\n",
      numbers(calibrate::position_of(studio.probe.cam_from_set)),
      capture::name_of(studio.probe.sensor.transfer),
      -static_cast<double>(studio.probe.start.count()) * 1e-9, patch[0], patch[1], patch[2],
      patch[3], number(card.albedo));
  text += fmt::format(
      "[[object]]\nname = \"car\"\nmade = \"car\"\n"
      "pose = {{ position = [0, 0, 0], yaw = {} }}\n\n",
      render::court_car_yaw_deg);
  text +=
      "[[stand_in]]\nname = \"court\"\nshape = \"plane\"\nsize = [16, 16]\n"
      "pose = { position = [0, 1.8, 0] }\ncatches = [\"shadow\", \"light\"]\nalbedo = 0.16\n\n";
  text += fmt::format(
      "[[stand_in]]\nname = \"crate\"\nshape = \"box\"\nsize = {}\n"
      "pose = {{ position = {}, yaw = {:.4f} }}\nblocks_light = true\n",
      fmt::format("[{:.6g}, {:.6g}, {:.6g}]", crate.size.x, crate.size.y, crate.size.z), fmt::format("[{:.6g}, {:.6g}, {:.6g}]", crate.middle.x, crate.middle.y,
                  crate.middle.z),
      crate.yaw_rad * degrees_per_rad);
  text += "\n[record]\nfile = \"take.mkv\"\n";
  write_text(dir / "car.toml", text);
}

void write_demo_truth(const fs::path& file, const render::MadeStudio& studio, int samples) {
  const auto plain = [](render::Vec3f v) { return nlohmann::json{v.x, v.y, v.z}; };
  nlohmann::ordered_json truth;
  truth["samples"] = samples;
  truth["seed"] = studio.settings.seed;
  truth["clap_s"] = demo_clap_s;
  truth["sun_direction"] = plain(studio.sky.sun_direction);
  // Plate units for one unit of the probe's light per second.
  truth["match"] = studio.probe.sensor.saturation;
  truth["card_albedo"] = render::court_card.albedo;
  auto& strengths = truth["sun_strength"] = nlohmann::json::array();
  for (int n = 0; n < studio.settings.frames; ++n) {
    strengths.push_back(render::sun_strength(studio, render::time_of_picture(studio.plate, n)));
  }
  for (const auto& [name, camera] :
       {std::pair{"plate", &studio.plate}, std::pair{"probe", &studio.probe}}) {
    truth[name] = {{"exposures_s", camera->exposures_s},
                   {"saturation", camera->sensor.saturation},
                   {"full_well_e", camera->sensor.full_well_e},
                   {"read_noise_e", camera->sensor.read_noise_e},
                   {"bits", camera->sensor.bits},
                   {"transfer", capture::name_of(camera->sensor.transfer)}};
  }
  write_text(file, truth.dump(2) + "\n");
}

}  // namespace studio
