// The parts that read_set is made of.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibrate/rig_file.h"
#include "studio/section.h"
#include "studio/set.h"

namespace studio {

// A set's rig: cameras that stand firmly to each other.
struct RigContext {
  bool is_there = false;
  std::optional<std::vector<calibrate::RigMember>> cameras;  // nothing = none, or a fault was added
  calibrate::Pose rig_from_set;
};

// What a camera's name in the rig stands for.
struct RigCamera {
  std::optional<calibrate::Lens> lens;  // nothing = a fault was added
  std::string lens_file;
  calibrate::Pose cam_from_set;
  std::string response;      // file; "" = none
  double time_offset_s = 0;  // how much later than the rig's clock its frames are stamped
};

// What the sections need to know of their surroundings.
struct SetContext {
  std::filesystem::path base;  // relative paths start here
  ShowSettings show;
  bool has_scene = false;  // objects or stand-ins: then a lens and a pose are needed
  RigContext rig;
  std::optional<double> plate_offset_s;  // of the plate's camera to its rig's clock
};

// Positions and sizes beyond this many metres are mistakes.
inline constexpr double farthest_m = 1e6;

// `fps`: a whole number or a fraction.
void read_fps(Section& section, std::optional<capture::Rational>& fps);

CameraSettings read_camera_section(Section section, const SetContext& context);
ProbeSettings read_probe_section(Section section, const SetContext& context);
ObjectSettings read_object_section(Section section, const SetContext& context);
StandInSettings read_stand_in_section(Section section, const SetContext& context);
LampSettings read_lamp_section(Section section);
VideoSettings read_video_section(Section section, const SetContext& context, bool lights);
PersonSettings read_billboard_section(Section section, const SetContext& context);
// Adds a fault for every person that is named as one before.
void refuse_same_names(const std::vector<PersonSettings>& persons, Faults& faults);
// Adds a fault for every use of a device that has another use before.
void refuse_shared_devices(const Set& set, Faults& faults);
// Names those that have none, with faults for names that there are twice.
void name_videos(std::vector<VideoSettings>& videos, Faults& faults);
// What the section leaves out stays as in `effort`.
render::Effort read_effort_section(Section section, render::Effort effort = {});
RecordSettings read_record_section(Section section,
                                   const std::filesystem::path& base,
                                   const ShowSettings& show);
// The same of a place: `pose` of an object.
PlacementSettings read_placement(Section table, PlacementSettings placement = {});

// The lens of a section: `lens` as a file's name or a table, or `model` and its values beside the
// section's other keys. `size` is that of the whole source picture, {0, 0} if unknown. Nothing if
// there is none, or it is bad and a fault was added. `file`: where its file's path goes, if it has
// one.
std::optional<calibrate::Lens> read_lens_key(Section& section,
                                             std::array<int, 2> size,
                                             const std::filesystem::path& base,
                                             std::string* file = nullptr);

// Faults for the keys of a lens that stand beside the section's others, where its lens is not one
// of them.
void refuse_lens_keys(Section& section, const std::string& why);

// How the probe is matched to the plate: `match`.
void read_match(Section& section, std::array<int, 2> picture, MatchSettings& match);

// A rectangle [x, y, width, height] of a picture; its size is 0 where it is not known here.
void read_rectangle(Section& section,
                    std::string_view key,
                    std::array<int, 2> picture,
                    std::optional<std::array<int, 4>>& rectangle);

// The lens of a part of its picture. False if that is no part of it, and a fault was added.
bool crop_lens(Section& section, const std::array<int, 4>& crop, calibrate::Lens& lens);

RigContext read_rig_section(Section section, const std::filesystem::path& base);

// The camera of the rig that `rig_camera` names, with faults for keys that it stands for. Nothing
// if there is no such key, or it is bad and a fault was added.
std::optional<RigCamera> read_rig_camera(Section& section, const SetContext& context);
// The same, put where it belongs.
std::optional<RigCamera> read_rig_camera(Section& section,
                                         const SetContext& context,
                                         std::optional<calibrate::Lens>& lens,
                                         calibrate::Pose& cam_from_set,
                                         std::string& response);

// The pose of a camera that stays where it is: position, and look_at or rotation.
calibrate::Pose read_fixed_pose(Section table);

// How a source's codes become light: `colour`, and, in its place, `response`.
void read_colour(Section& section, capture::Transfer& colour);
void read_response_key(Section& section, const std::filesystem::path& base, std::string& response);

// How much later than the plate's a camera's frames are stamped: `offset_s`, or, if both are of one
// rig, what the rig says.
void read_offset(Section& section,
                 const SetContext& context,
                 const std::optional<RigCamera>& of_rig,
                 double& offset_s);

// Where a source begins, `frame`; of a device nowhere but at 0. False if there is no such key.
bool read_start(Section& section, const std::string& uri, std::int64_t& frame);

// Whether a video file is deinterlaced, `deinterlace`; a fault with what is none.
void read_deinterlace(Section& section, const std::string& uri, std::optional<bool>& deinterlace);

// A source's URI with its path made absolute and, where it names a file or directory, found. Of a
// device, that its settings can be read: it need not be there.
bool read_source_key(Section& section,
                     std::string_view key,
                     const std::filesystem::path& base,
                     std::string& uri);

}  // namespace studio
