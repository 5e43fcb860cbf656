// Scenes of ours as files that others make: to measure and test how models are read.
#pragma once

#include <string>

#include "render/scene.h"

namespace render {

// Writes a scene as binary glTF 2.0, y up: every instance a node of its name, normals and texture
// coordinates, and of the materials base colour, metallic, roughness, transmission and emission,
// or glass as a volume. Textures and videos are left out. Throws std::runtime_error if the file
// cannot be written, std::invalid_argument if a mesh has several materials.
void write_glb(const std::string& path, const SceneDescription& scene);

// Writes all triangles of a scene, each instance in its place, as a binary PLY, little-endian.
// Throws std::runtime_error if the file cannot be written.
void write_ply(const std::string& path, const SceneDescription& scene);

}  // namespace render
