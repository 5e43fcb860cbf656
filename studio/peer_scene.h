// A bench scene as files that other renderers can read, for comparisons with them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "render/mesh.h"
#include "studio/bench_scene.h"

namespace studio {

// What the peers are asked to show.
struct PeerScene {
  BenchScene shot;  // its plate an even grey
  bool direct_light_only = false;
};

// "matte": the car, all of it Lambert, under direct light alone. "paint": the car in its clear-coat
// paint, dark glass, chrome and alloy; "glass": the same with a ball of solid glass before it. All
// on a floor that catches shadows. Throws std::invalid_argument for another name.
PeerScene make_peer_scene(const std::string& name, int width, int height);
const std::vector<std::string>& peer_scene_names();

// The triangles of one material, of all virtual objects, in the set's frame. Every vertex has its
// normal, flat meshes three vertices to a triangle; corners run counter-clockwise seen from the
// side that the normals are on.
render::Mesh triangles_of_material(const render::SceneDescription& scene, std::uint32_t material);

// Writes into `directory`, which it makes:
//   material_N.ply  triangles_of_material, binary
//   light.exr       the environment, as render::Environment lies, 32-bit floats
//   scene.json      size, lens, pose, parts with their materials, the floor's and plate's colours
// The floor is to be Lambert of the stated albedo, unseen by shadow and mirrored rays: in the
// environment's light it has the plate's radiance. Throws std::runtime_error with the path if a
// file cannot be written.
void write_peer_scene(const PeerScene& scene, const std::filesystem::path& directory);

}  // namespace studio
