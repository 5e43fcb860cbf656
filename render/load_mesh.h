// Models from files, through assimp: glTF (also Draco-compressed), OBJ, PLY, STL, FBX, X3D.
#pragma once

#include <cstddef>
#include <stop_token>
#include <string>
#include <vector>

#include "render/scene.h"

namespace render {

// Which axis of the file is up. `by_format`: y for glTF, OBJ, X3D; as the file says for FBX; z for
// PLY and STL.
enum class UpAxis { by_format, y, z };

struct LoadOptions {
  double scale = 1;               // set metres per file unit (glTF's unit is the metre)
  std::vector<std::string> hide;  // nodes left out, with everything under them
  float emission_gain = 1;        // multiplies what the materials emit
  UpAxis up = UpAxis::by_format;
  bool whole = false;        // refused where triangles would be left out
  bool shape_alone = false;  // meshes and instances; no materials, no textures
};

struct LoadReport {
  std::size_t triangles = 0;  // over all instances
  std::size_t vertices = 0;   // over all meshes
  std::size_t materials = 0;
  std::size_t textures = 0;
  std::size_t texture_bytes = 0;
  std::vector<std::string> nodes;  // nodes with a mesh, hidden ones included, in the file's order
  std::vector<std::string> notes;  // what was not understood or left out, in words
  Vec3f lower, upper;              // bounds of what is shown, set metres
};

struct LoadedModel {
  SceneDescription scene;  // virtual objects, shader "standard", each instance named by its node
  LoadReport report;
};

// Loads a model. Each node becomes an instance (more if its mesh has several materials), its place
// in `set_from_object`: the model's origin stays the set's, y-up files are turned, (x, y, z) to (x,
// -z, y). Hidden parts are not even decoded. Tangents are computed where a normal map needs them.
//
// The file is read by a helper program under limits (models.md), since what is damaged may crash or
// hang what reads it: that is an error here and nothing more.
//
// glTF materials: base colour, metallic-roughness, normal, clear coat, transmission (as a thin
// wall; a volume of it as solid glass, glass.h, if it is hardly rough), emission, alpha cut out or
// blended, vertex colours without their alpha. Not handled, and noted in the report: occlusion maps
// (the light is traced) and every other map that is not taken, sheen, volumes that are not clear,
// the roughness of transmission, animation. Morph targets and skins of glTF show as they rest
// (models.md); those of FBX are noted. Materials of other formats: colour, opacity, shininess,
// emission.
//
// A texture that is not there or cannot be decoded is told in the notes and replaced: base colour
// by magenta, linear (1, 0, 1), emission and transmission by 0; other maps are left out. Normals
// and texture coordinates that are not finite are mended, triangles with such positions are left
// out.
//
// Throws std::invalid_argument if scale is not > 0 and finite, or `hide` names a node that is not
// there (the nodes are listed). Throws std::runtime_error naming file and reason if the file cannot
// be read, is damaged, holds no triangles, is too large (64 M triangles, 4 GB of texels),
// takes its reader more memory or time than a file of its size may, or refers to anything outside
// its own folder; or, soon, once a stop is requested.
LoadedModel load_model(const std::string& path,
                       const LoadOptions& options = {},
                       const std::stop_token& stop = {});

}  // namespace render
