// From a set's objects, stand-ins and lamps to what the kernel renders.
#pragma once

#include <array>
#include <vector>

#include "render/scene.h"
#include "studio/set.h"

namespace studio {

// The scene of a set: first all objects, each part of each copy an instance named "OBJECT/PART",
// then the stand-ins. Camera rays that meet nothing see the plate. Throws SetError naming every
// mesh that cannot be loaded, with its place in the set file.
render::SceneDescription describe_scene(const Set& set);

// Rows of the 3x4 matrix set_from_object of a placement.
std::array<float, 12> matrix_of(const PlacementSettings& placement);

// The set's own lamps.
std::vector<render::LocalLight> describe_lamps(const Set& set);

}  // namespace studio
