// Set files: the camera and the probe.
#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>

#include "calibrate/angles.h"
#include "calibrate/track.h"
#include "calibrate/vignetting.h"
#include "capture/camera.h"
#include "capture/camera_response.h"
#include "studio/set_sections.h"

namespace studio {
namespace {

namespace fs = std::filesystem;

using calibrate::degree;
constexpr Range metres{-farthest_m, farthest_m};
constexpr Range exposure_range{1e-9, 3600};
constexpr Range angle_range{-3600, 3600};

// A rotation from a set's nine numbers; `position` is where the camera or probe stands.
std::optional<calibrate::Pose> read_rotation(Section& table, calibrate::Vec3 position) {
  std::vector<double> numbers;
  if (!table.numbers("rotation", numbers, {9}, {-1.001, 1.001})) return std::nullopt;
  calibrate::Mat3 rotation;
  std::ranges::copy(numbers, rotation.m.begin());
  try {
    return calibrate::pose_from_rotation(rotation, position);
  } catch (const std::invalid_argument& error) {
    table.fault("rotation", fmt::format("cannot be used: {}", error.what()));
    return std::nullopt;
  }
}

// Position, and the way that it looks; `track` is a third way where a camera may move.
calibrate::Pose read_way(Section& table) {
  calibrate::Vec3 position;
  table.vector("position", position, metres);
  double roll_deg = 0;
  table.number("roll", roll_deg, angle_range);
  table.of_use_only(table.has("look_at"), "roll", "look_at");
  calibrate::Pose cam_from_set;
  calibrate::Vec3 target;
  if (table.vector("look_at", target, metres)) {
    try {
      cam_from_set = calibrate::look_at(position, target, roll_deg * degree);
    } catch (const std::invalid_argument& error) {
      table.fault("look_at", fmt::format("cannot be used: {}", error.what()));
    }
  }
  if (const auto rotated = read_rotation(table, position)) cam_from_set = *rotated;
  return cam_from_set;
}

void read_camera_pose(Section table, const fs::path& base, PoseSettings& pose) {
  const int ways = int{table.has("look_at")} + int{table.has("rotation")} + int{table.has("track")};
  if (ways != 1) {
    table.fault("",
                "must have exactly one of look_at = [x, y, z], rotation = [nine numbers], "
                "track = \"poses.csv\"");
  }
  if (!table.has("track")) table.need("position", "where the camera stands, in metres");
  table.of_use_only(!table.has("track"), "position", "look_at or rotation: a track has its own");
  pose.cam_from_set = read_way(table);
  if (table.file("track", base, pose.track)) {
    try {
      static_cast<void>(calibrate::read_track(pose.track));
    } catch (const std::runtime_error& error) {
      table.fault("track", fmt::format("cannot be used: {}", error.what()));
    }
  }
  table.finish();
}

// The lens of the show's picture from the lens of the source's: cropped, then resized.
void fit_lens(Section& section, const SetContext& context, CameraSettings& camera) {
  const ShowSettings& show = context.show;
  if (show.width < 1 || show.height < 1) return;  // a fault already
  const std::string_view key = section.has("rig_camera") ? "rig_camera"
                               : section.has("lens")     ? "lens"
                                                         : "model";
  camera.lens_size = {camera.lens.width, camera.lens.height};
  if (camera.crop && !crop_lens(section, *camera.crop, camera.lens)) return;
  if (camera.lens.width == show.width && camera.lens.height == show.height) return;
  section.fault(key,
                fmt::format("gives a picture of {}x{}, but the show is {}x{}: set camera.crop, or "
                            "show.width and show.height",
                            camera.lens.width, camera.lens.height, show.width, show.height));
}

void read_exposures(Section& section, ProbeSettings& probe) {
  section.number("exposure_error", probe.exposure_error, {0.001, 1});
  const TomlValue* given = section.value("exposures");
  if (given == nullptr) return;
  if (given->kind == TomlValue::Kind::text) {
    std::string word;
    section.word("exposures", word, {"auto"});
    probe.asks_auto = true;
  } else {
    section.numbers("exposures", probe.exposures_s, {}, exposure_range);
  }
}

void read_probe_pose(Section table, calibrate::Pose& probe_from_set) {
  calibrate::Vec3 axis{0, 0, 1};
  calibrate::Vec3 position;
  double roll_deg = 0;
  if (table.has("axis") == table.has("rotation")) {
    table.fault("", "must have either axis = [x, y, z] or rotation = [nine numbers, set to probe]");
  }
  table.vector("position", position, metres);
  table.number("roll", roll_deg, angle_range);
  table.of_use_only(table.has("axis"), "roll", "axis");
  if (table.vector("axis", axis, metres)) {
    try {
      probe_from_set = calibrate::pose_from_axis(position, axis, roll_deg * degree);
    } catch (const std::invalid_argument& error) {
      table.fault("axis", fmt::format("cannot be used: {}", error.what()));
    }
  }
  if (const auto rotated = read_rotation(table, position)) probe_from_set = *rotated;
  table.finish();
}

void read_vignetting(Section& section, std::vector<double>& vignetting) {
  section.numbers("vignetting", vignetting, {1, 2, 3, 4}, {-1e3, 1e3});
}

void check_vignetting(Section& section,
                      std::span<const double> vignetting,
                      const calibrate::Lens& lens) {
  try {
    calibrate::check_vignetting(vignetting, lens);
  } catch (const std::invalid_argument& error) {
    section.fault("vignetting", fmt::format("cannot be used: {}", error.what()));
  }
}

// A list of pictures, a directory of pictures, a map, or a camera of brackets.
void read_probe_source(Section& section, const fs::path& base, ProbeSettings& probe) {
  section.need("source", "a map, a list or directory of shots, or a camera's URI");
  const TomlValue* given = section.value("source");
  if (given == nullptr) return;
  probe.source_place = given->place;
  if (given->kind == TomlValue::Kind::array) {
    probe.kind = ProbeSettings::Kind::bracket;
    if (section.texts("source", probe.shots)) {
      for (std::string& shot : probe.shots) {
        shot = (base / shot).lexically_normal().string();
        if (std::error_code error; !fs::is_regular_file(shot, error)) {
          section.fault("source", fmt::format("names {}, which is not a file", shot));
        }
      }
      if (probe.shots.empty()) section.fault("source", "lists no shots");
    }
    return;
  }
  if (!read_source_key(section, "source", base, probe.source)) return;
  const std::string path = probe.source.starts_with("file:") ? probe.source.substr(5) : "";
  std::error_code error;
  if (fs::is_directory(path, error)) {
    probe.kind = ProbeSettings::Kind::bracket;
    for (const auto& entry : fs::directory_iterator(path, error)) {
      std::error_code none;
      if (entry.is_regular_file(none)) probe.shots.push_back(entry.path().string());
    }
    std::ranges::sort(probe.shots);
    if (error) {
      section.fault("source", fmt::format("{} cannot be looked into: {}", path, error.message()));
    } else if (probe.shots.empty()) {
      section.fault("source", fmt::format("{} holds no files", path));
    }
  } else if (path.empty()) {
    probe.kind = ProbeSettings::Kind::camera;
  }
}

}  // namespace

void read_colour(Section& section, capture::Transfer& colour) {
  std::string name;
  if (!section.text("colour", name)) return;
  try {
    colour = capture::transfer_from_name(name);
  } catch (const std::invalid_argument& error) {
    section.fault("colour", fmt::format("\"{}\": {}", name, error.what()));
  }
}

calibrate::Pose read_fixed_pose(Section table) {
  if (table.has("look_at") == table.has("rotation")) {
    table.fault("", "must have either look_at = [x, y, z] or rotation = [nine numbers]");
  }
  table.need("position", "where it stands, in metres");
  table.of_use_only(false, "track", "the show's camera: this one stays where it is");
  const calibrate::Pose pose = read_way(table);
  table.finish();
  return pose;
}

bool crop_lens(Section& section, const std::array<int, 4>& crop, calibrate::Lens& lens) {
  const auto [x, y, width, height] = crop;
  if (x + width > lens.width || y + height > lens.height) {
    section.fault(
        "crop", fmt::format("reaches beyond the lens's picture of {}x{}", lens.width, lens.height));
    return false;
  }
  lens = calibrate::cropped(lens, x, y, width, height);
  return true;
}

bool read_start(Section& section, const std::string& uri, std::int64_t& frame) {
  if (!section.integer("frame", frame, std::int64_t{0}, std::int64_t{1} << 40)) return false;
  if (frame > 0 && capture::is_device(uri)) {
    section.fault("frame", "is of use only with what was recorded: a device starts at its frame 0");
  }
  return true;
}

void read_deinterlace(Section& section, const std::string& uri, std::optional<bool>& deinterlace) {
  if (bool given = false; section.boolean("deinterlace", given)) deinterlace = given;
  section.of_use_only(uri.empty() || uri.starts_with("file:"), "deinterlace",
                      "video files: other sources' pictures are taken as they come");
}

bool read_source_key(Section& section,
                     std::string_view key,
                     const fs::path& base,
                     std::string& uri) {
  std::string given;
  if (!section.text(key, given)) return false;
  const std::size_t colon = given.find(':');
  std::error_code ignored;
  const bool is_path = colon == std::string::npos ||
                       (!capture::has_scheme(given) &&
                        (given.find('/') < colon || fs::exists(base / given, ignored)));
  const std::string scheme = is_path ? "file" : given.substr(0, colon);
  const std::string rest = is_path ? given : given.substr(colon + 1);
  if (scheme != "file" && scheme != "replay") {
    try {
      capture::check_camera_uri(given);
    } catch (const std::runtime_error& error) {
      section.fault(key, fmt::format("cannot be opened: {}", error.what()));
      return false;
    }
    uri = given;
    return true;
  }
  const fs::path path = (base / rest).lexically_normal();
  // A sequence is found when it is opened: here, only that its directory is there.
  const bool sequence = path.filename().string().find('%') != std::string::npos;
  std::error_code error;
  if (!fs::exists(sequence ? path.parent_path() : path, error)) {
    section.fault(key, words_for_missing(path, error));
    return false;
  }
  uri = scheme + ":" + path.string();
  return true;
}

void read_response_key(Section& section, const fs::path& base, std::string& response) {
  if (!section.file("response", base, response)) return;
  try {
    static_cast<void>(capture::read_response(response));
  } catch (const std::runtime_error& error) {
    section.fault("response", fmt::format("cannot be used: {}", error.what()));
  }
}

void read_offset(Section& section,
                 const SetContext& context,
                 const std::optional<RigCamera>& of_rig,
                 double& offset_s) {
  section.number("offset_s", offset_s, {-60, 60});
  if (!of_rig || !context.plate_offset_s) return;
  offset_s = of_rig->time_offset_s - *context.plate_offset_s;
  if (section.value("offset_s") != nullptr) {
    section.fault("offset_s",
                  "is the rig's already, which both cameras are of: leave out either it or "
                  "rig_camera");
  }
}

namespace {

// The lens, the pose and the response of a camera that is of no rig.
void read_own_camera(Section& section,
                     const SetContext& context,
                     bool cropped,
                     CameraSettings& camera) {
  const ShowSettings& show = context.show;
  const std::array<int, 2> size = cropped ? std::array{0, 0} : std::array{show.width, show.height};
  if (auto lens = read_lens_key(section, size, context.base)) {
    camera.lens = *lens;
    fit_lens(section, context, camera);
  } else if (context.has_scene && !section.has("lens") && !section.has("model")) {
    section.need("lens", "objects are seen through it: a file, or model and focal_px");
  }
  read_response_key(section, context.base, camera.response);
  camera.pose_place = section.place_of("pose");
  if (context.has_scene) section.need("pose", "where the camera is in the set");
  if (auto table = section.table("pose")) read_camera_pose(*table, context.base, camera.pose);
}

// The same of a probe; what a map is turned by is apart.
void read_own_probe(Section& section, const SetContext& context, ProbeSettings& probe) {
  const bool is_map = probe.kind == ProbeSettings::Kind::map;
  const TomlValue* lens = section.value("lens");
  const bool latlong =
      lens != nullptr && lens->kind == TomlValue::Kind::text && lens->text == "latlong";
  if (latlong) refuse_lens_keys(section, "is of another lens: leave out either it or lens");
  if (!latlong) probe.lens = read_lens_key(section, {0, 0}, context.base);
  if (!is_map && lens == nullptr && !section.has("model")) {
    section.need("lens", "how the probe sees: a file, a table, or \"latlong\"");
  }
  if (auto table = section.table("pose")) read_probe_pose(*table, probe.probe_from_set);
  if (!is_map && !latlong) section.need("pose", "how the probe is turned");
  read_response_key(section, context.base, probe.response);
}

}  // namespace

CameraSettings read_camera_section(Section section, const SetContext& context) {
  CameraSettings camera;
  section.need("source", "the plate: a file or a camera's URI");
  camera.source_place = section.place_of("source");
  read_source_key(section, "source", context.base, camera.source);
  const bool cropped = section.has("crop");
  read_rectangle(section, "crop", {0, 0}, camera.crop);
  std::int64_t frame = 0;
  if (read_start(section, camera.source, frame)) camera.frame = frame;
  read_colour(section, camera.colour);
  double exposure_s = 0;
  if (section.number("exposure_s", exposure_s, exposure_range)) camera.exposure_s = exposure_s;
  section.boolean("loop", camera.loop);
  read_deinterlace(section, camera.source, camera.deinterlace);

  if (section.has("rig_camera")) {
    if (const auto of_rig = read_rig_camera(section, context)) {
      if (of_rig->lens) camera.lens = *of_rig->lens;
      if (of_rig->lens) fit_lens(section, context, camera);
      camera.pose.cam_from_set = of_rig->cam_from_set;
      camera.pose_place = section.place_of("rig_camera");
      camera.response = of_rig->response;
      camera.rig_offset_s = of_rig->time_offset_s;
    }
  } else {
    read_own_camera(section, context, cropped, camera);
  }
  read_vignetting(section, camera.vignetting);
  if (camera.lens.width > 0) check_vignetting(section, camera.vignetting, camera.lens);
  section.finish();
  return camera;
}

ProbeSettings read_probe_section(Section section, const SetContext& context) {
  ProbeSettings probe;
  read_probe_source(section, context.base, probe);
  std::optional<RigCamera> of_rig;
  if (section.has("rig_camera")) {
    of_rig = read_rig_camera(section, context, probe.lens, probe.probe_from_set, probe.response);
  } else {
    read_own_probe(section, context, probe);
  }
  read_offset(section, context, of_rig, probe.offset_s);
  if (double yaw_deg = 0; section.number("yaw", yaw_deg, angle_range)) {
    probe.yaw_rad = yaw_deg * degree;
  }
  section.of_use_only(!probe.lens, "yaw", "a map: a lens has its pose");

  read_exposures(section, probe);
  if (!probe.exposures_s.empty() && !probe.shots.empty() &&
      probe.exposures_s.size() != probe.shots.size()) {
    section.fault("exposures", fmt::format("has {} times for {} shots", probe.exposures_s.size(),
                                           probe.shots.size()));
  }
  std::string unseen = "floor";
  section.word("unseen", unseen, {"floor", "mirror", "mean"});
  probe.unseen = unseen == "mirror" ? render::Unseen::mirror
                 : unseen == "mean" ? render::Unseen::mean
                                    : render::Unseen::floor;
  const std::array picture{context.show.width, context.show.height};
  read_match(section, picture, probe.match);
  read_rectangle(section, "albedo_patch", picture, probe.albedo_patch);
  read_vignetting(section, probe.vignetting);
  if (probe.lens && probe.lens->width > 0) {
    check_vignetting(section, probe.vignetting, *probe.lens);
  }
  read_colour(section, probe.colour);
  section.finish();
  return probe;
}

}  // namespace studio
