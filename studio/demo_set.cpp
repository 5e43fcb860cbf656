// The made set in words: set file, lenses, truth.
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "calibrate/track.h"
#include "capture/files.h"
#include "studio/demo_files.h"

namespace studio {
namespace {

namespace fs = std::filesystem;

// Nine digits: what is left out is far below a pixel.
std::string number(double value) { return fmt::format("{:.9g}", value + 0.0); }

std::string numbers(calibrate::Vec3 v) {
  return fmt::format("[{}, {}, {}]", number(v.x), number(v.y), number(v.z));
}

// As many digits as floats have.
std::string numbers(render::Vec3f v) {
  return fmt::format("[{:.6g}, {:.6g}, {:.6g}]", v.x, v.y, v.z);
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

std::string show_section(const render::MadeStudio& studio) {
  return fmt::format("[show]\nwidth = {}\nheight = {}\nfps = {}\n\n", studio.plate.lens.width,
                     studio.plate.lens.height, studio.plate.rate.num);
}

std::string camera_section(const render::MadeStudio& studio, const std::string& prefix) {
  const render::MadeCamera& plate = studio.plate;
  const std::string pose = plate.track.keys.empty()
                               ? fmt::format("{{ position = {}, rotation = {} }}",
                                             numbers(calibrate::position_of(plate.cam_from_set)),
                                             rotation(plate.cam_from_set))
                               : fmt::format("{{ track = \"{}plate.csv\" }}", prefix);
  return fmt::format(
      "[camera]\nsource = \"file:{0}plate.mkv\"\nlens = \"{0}scene.cameramodel\"\n"
      "pose = {1}\ncolour = \"{2}\"\nexposure_s = {3}\n\n",
      prefix, pose, capture::name_of(plate.sensor.transfer), plate.exposures_s.front());
}

std::string probe_section(const render::MadeStudio& studio,
                          const std::string& prefix,
                          const std::string& match) {
  return fmt::format(
      "[probe]\nsource = \"replay:{0}probe\"\nlens = \"{0}probe.toml\"\n"
      "pose = {{ position = {1}, axis = [0, 0, 1] }}\n"
      "colour = \"{2}\"\nexposures = \"auto\"\n"
      "offset_s = {3:.9f}  # the recording of the probe began so much before the plate\n"
      "unseen = \"floor\"\nmatch = {4}\n\n",
      prefix, numbers(calibrate::position_of(studio.probe.cam_from_set)),
      capture::name_of(studio.probe.sensor.transfer),
      -static_cast<double>(studio.probe.start.count()) * 1e-9, match);
}

std::string car_section(const render::MadeStudio& studio) {
  return fmt::format(
      "[[object]]\nname = \"car\"\nmade = \"car\"\n"
      "pose = {{ position = [0, 0, 0], yaw = {} }}\n\n",
      studio.car_yaw_deg);
}

// The lamp as an object, and what it shines as one point.
std::string lamp_sections(const render::MadeStudio& studio) {
  if (!studio.lamp) return "";
  const render::LocalLight light = lights_of_lamp(studio, 1).front();
  return fmt::format(
      "[[object]]\nname = \"lamp\"\nmade = \"lamp\"\npose = {{ position = {}, yaw = {} }}\n\n"
      "[[lamp]]\nposition = {}\nfacing = {}\nintensity = {}\n\n",
      numbers(studio.lamp->foot), studio.lamp->yaw_deg, numbers(light.position),
      numbers(light.normal), numbers(light.intensity));
}

}  // namespace

void write_text(const fs::path& file, std::string_view text) {
  capture::write_file(file.string(), std::as_bytes(std::span(text)));
}

std::string court_set(const render::MadeStudio& studio, const std::string& prefix) {
  const auto& card = render::court_card;
  const auto patch = render::picture_of_card(studio);
  const auto& crate = render::court_crate;
  constexpr double degrees_per_rad = 57.29577951308232;
  std::string text = "# A made car on a made court. truth/ holds what a camera would have seen.\n";
  text += "name = \"made car on the court\"\n\n";
  text += show_section(studio) + camera_section(studio, prefix);
  text += probe_section(
      studio, prefix,
      fmt::format("{{ patch = [{}, {}, {}, {}], albedo = {} }}  # a grey card on the ground",
                  patch[0], patch[1], patch[2], patch[3], number(card.albedo)));
  text += car_section(studio) + lamp_sections(studio);
  text +=
      "[[stand_in]]\nname = \"court\"\nshape = \"plane\"\nsize = [16, 16]\n"
      "pose = { position = [0, 1.8, 0] }\ncatches = [\"shadow\", \"light\"]\nalbedo = 0.16\n"
      "mirrored = true  # in the paint: the ground that the camera sees, in the car's shadow\n\n";
  text += fmt::format(
      "[[stand_in]]\nname = \"crate\"\nshape = \"box\"\nsize = {}\n"
      "pose = {{ position = {}, yaw = {:.4f} }}\nblocks_light = true\n",
      numbers(crate.size), numbers(crate.middle), crate.yaw_rad * degrees_per_rad);
  text += "\n[record]\nfile = \"take.mkv\"\n";
  return text;
}

std::string park_set(const render::MadeStudio& studio, const std::string& prefix) {
  std::string text =
      "# A made car on a made parking place, in the light of a real park: its map is the distance\n"
      "# behind the place and the light on it, so plate and probe are of one world, under one "
      "real\n"
      "# sun. The camera pans. The footage, with its truth and with this set, is made by\n"
      "#\n"
      "#     platelight demo demo/park --world park --map ../shared/data/env/park.hdr\n"
      "#\n"
      "# in the project's directory. Of the same map, turned the same way: its middle lies to "
      "+x.\n";
  text += "name = \"made car in the park\"\n\n";
  text += show_section(studio) + camera_section(studio, prefix);
  text += probe_section(studio, prefix, "\"auto\"  # from the sky that both cameras see");
  text += car_section(studio);
  text +=
      "# The sun is low: the shadow is more than five times as long as the car is high.\n"
      "[[stand_in]]\nname = \"ground\"\nshape = \"plane\"\nsize = [24, 24]\n"
      "pose = { position = [0, 1.8, 0] }\ncatches = [\"shadow\", \"light\"]\nalbedo = 0.16\n"
      "mirrored = true\n";
  return text;
}

void write_demo_cameras(const fs::path& dir, const render::MadeStudio& studio) {
  calibrate::write_lens((dir / "scene.cameramodel").string(), studio.plate.lens);
  calibrate::write_lens((dir / "probe.toml").string(), studio.probe.lens);
  if (!studio.plate.track.keys.empty()) {
    calibrate::write_track((dir / "plate.csv").string(), studio.plate.track);
  }
}

void write_demo_truth(const fs::path& file,
                      const DemoSettings& settings,
                      const render::MadeStudio& studio) {
  const auto plain = [](render::Vec3f v) { return nlohmann::json{v.x, v.y, v.z}; };
  const render::MadeStudioSettings& made = settings.studio;
  nlohmann::ordered_json truth;
  truth["world"] = settings.world == DemoWorld::court ? "court" : "park";
  if (!settings.map.empty()) truth["map"] = fs::absolute(settings.map).lexically_normal().string();
  truth["width"] = made.width;
  truth["height"] = made.height;
  truth["probe_size"] = made.probe_size;
  truth["sky_height"] = made.sky_height;
  truth["texture_size"] = made.texture_size;
  truth["frames"] = made.frames;
  truth["lamp"] = settings.lamp;
  truth["samples"] = settings.samples;
  truth["seed"] = made.seed;
  truth["clap_s"] = demo_clap_s;
  truth["car_yaw_deg"] = studio.car_yaw_deg;
  truth["sun_direction"] = plain(studio.sky.sun_direction);
  // Plate units for one unit of the probe's light per second.
  truth["match"] = studio.probe.sensor.saturation;
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

DemoSettings read_demo_truth(const fs::path& file) {
  const std::vector<std::byte> bytes = capture::read_file(file.string());
  try {
    const auto truth =
        nlohmann::json::parse(reinterpret_cast<const char*>(bytes.data()),
                              reinterpret_cast<const char*>(bytes.data()) + bytes.size());
    DemoSettings settings;
    settings.dir = file.parent_path().parent_path();
    const std::string world = truth.at("world");
    if (world != "court" && world != "park") {
      throw std::runtime_error("there is no world \"" + world + "\"");
    }
    settings.world = world == "court" ? DemoWorld::court : DemoWorld::park;
    settings.map = truth.value("map", "");
    settings.studio = {.width = truth.at("width"),
                       .height = truth.at("height"),
                       .probe_size = truth.at("probe_size"),
                       .sky_height = truth.at("sky_height"),
                       .texture_size = truth.at("texture_size"),
                       .frames = truth.at("frames"),
                       .seed = truth.at("seed")};
    settings.lamp = truth.at("lamp");
    settings.samples = truth.at("samples");
    return settings;
  } catch (const std::exception& error) {
    throw std::runtime_error(file.string() +
                             ": is no truth of \"platelight demo\": " + error.what());
  }
}

}  // namespace studio
