// A rig of cameras in a file.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "calibrate/pose.h"

namespace calibrate {

// A camera of a rig, and what it takes to use it.
struct RigMember {
  std::string name;
  std::string lens;  // its file
  Pose cam_from_rig;
  double time_offset_s = 0;  // how much later than the rig's clock its frames are stamped
  std::string response;      // its file; empty = none
  friend bool operator==(const RigMember&, const RigMember&) = default;
};

// Reads [[camera]] tables (files.md). Files of lenses and responses are found relative to the rig's
// and are not read here. Throws std::runtime_error with path, line and key: what is missing, of the
// wrong kind, not finite, unknown, not a rotation; a name that is twice.
std::vector<RigMember> read_rig(const std::string& path);

// Writes a .toml that read_rig reads; files within its folder are named relative to it. `comment`
// stands in its first line. Throws std::invalid_argument for another ending, a camera without name
// or lens, or a name that is twice; std::runtime_error if the file cannot be written.
void write_rig(const std::string& path,
               std::span<const RigMember> cameras,
               const std::string& comment);

}  // namespace calibrate
