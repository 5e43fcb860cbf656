// The parts that read_set is made of.
#pragma once

#include <filesystem>

#include "studio/section.h"
#include "studio/set.h"

namespace studio {

// What the sections need to know of their surroundings.
struct SetContext {
  std::filesystem::path base;  // relative paths start here
  ShowSettings show;
  bool has_scene = false;  // objects or stand-ins: then a lens and a pose are needed
};

// Positions and sizes beyond this many metres are mistakes.
inline constexpr double farthest_m = 1e6;

CameraSettings read_camera_section(Section section, const SetContext& context);
ProbeSettings read_probe_section(Section section, const SetContext& context);
ObjectSettings read_object_section(Section section, const SetContext& context);
StandInSettings read_stand_in_section(Section section, const SetContext& context);
LampSettings read_lamp_section(Section section);
render::Effort read_effort_section(Section section);

// The lens of a section: `lens` as a file's name or a table, or `model` and its values beside the
// section's other keys. `size` is that of the whole source picture, {0, 0} if unknown. Nothing if
// there is none, or it is bad and a fault was added.
std::optional<calibrate::Lens> read_lens_key(Section& section,
                                             std::array<int, 2> size,
                                             const std::filesystem::path& base);

// How the probe is matched to the plate: `match`.
void read_match(Section& section, std::array<int, 2> picture, MatchSettings& match);

// A rectangle [x, y, width, height] of a picture; its size is 0 where it is not known here.
void read_rectangle(Section& section,
                    std::string_view key,
                    std::array<int, 2> picture,
                    std::optional<std::array<int, 4>>& rectangle);

// A source's URI with its path made absolute and, where it names a file or directory, found.
bool read_source_key(Section& section,
                     std::string_view key,
                     const std::filesystem::path& base,
                     std::string& uri);

}  // namespace studio
