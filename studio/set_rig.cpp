// Set files: the rig, and the cameras that are of it.
#include <algorithm>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>

#include "capture/camera_response.h"
#include "studio/set_sections.h"

namespace studio {
namespace {

std::string names_of(const std::vector<calibrate::RigMember>& cameras) {
  std::string names;
  for (const calibrate::RigMember& camera : cameras) {
    names += (names.empty() ? "\"" : ", \"") + camera.name + "\"";
  }
  return names;
}

// Faults at the keys that the rig's camera stands for.
void refuse_written_out(Section& section) {
  const std::string why = "is the rig's already: leave out either it or rig_camera";
  for (const std::string_view key : {"lens", "pose", "response"}) {
    if (section.value(key) != nullptr) section.fault(key, why);
  }
  refuse_lens_keys(section, why);
}

}  // namespace

RigContext read_rig_section(Section section, const std::filesystem::path& base) {
  RigContext rig;
  rig.is_there = true;
  section.need("file", "the rig: a .toml file of calibrate rig");
  std::string path;
  if (section.file("file", base, path)) {
    try {
      rig.cameras = calibrate::read_rig(path);
    } catch (const std::runtime_error& error) {
      section.fault("file", fmt::format("cannot be used: {}", error.what()));
    }
  }
  if (auto table = section.table("pose")) rig.rig_from_set = read_fixed_pose(*table);
  section.finish();
  return rig;
}

std::optional<RigCamera> read_rig_camera(Section& section, const SetContext& context) {
  std::string name;
  if (!section.text("rig_camera", name)) return std::nullopt;
  refuse_written_out(section);
  if (!context.rig.is_there) {
    section.fault("rig_camera", "needs [rig] with the rig's file");
    return std::nullopt;
  }
  if (!context.rig.cameras) return std::nullopt;  // a fault already
  const auto member = std::ranges::find(*context.rig.cameras, name, &calibrate::RigMember::name);
  if (member == context.rig.cameras->end()) {
    section.fault("rig_camera", fmt::format("is \"{}\", but the rig's cameras are {}", name,
                                            names_of(*context.rig.cameras)));
    return std::nullopt;
  }
  RigCamera camera;
  camera.cam_from_set = member->cam_from_rig * context.rig.rig_from_set;
  camera.time_offset_s = member->time_offset_s;
  camera.response = member->response;
  if (std::error_code error;
      !camera.response.empty() && !std::filesystem::is_regular_file(camera.response, error)) {
    section.fault("rig_camera", fmt::format("has the response {} in the rig's file, which does "
                                            "not exist",
                                            camera.response));
  } else if (!camera.response.empty()) {
    try {
      static_cast<void>(capture::read_response(camera.response));
    } catch (const std::runtime_error& wrong) {
      section.fault("rig_camera", fmt::format("has a response in the rig's file that cannot be "
                                              "used: {}",
                                              wrong.what()));
    }
  }
  for (const std::string& named : {member->lens, member->response}) {
    if (!named.empty()) section.names("rig_camera", named);
  }
  try {
    camera.lens = calibrate::read_lens(member->lens);
    camera.lens_file = member->lens;
  } catch (const std::runtime_error& error) {
    section.fault("rig_camera", fmt::format("has a lens in the rig's file that cannot be used: {}",
                                            error.what()));
  }
  return camera;
}

std::optional<RigCamera> read_rig_camera(Section& section,
                                         const SetContext& context,
                                         std::optional<calibrate::Lens>& lens,
                                         calibrate::Pose& cam_from_set,
                                         std::string& response) {
  auto camera = read_rig_camera(section, context);
  if (camera) {
    lens = camera->lens;
    cam_from_set = camera->cam_from_set;
    response = camera->response;
  }
  return camera;
}

}  // namespace studio
