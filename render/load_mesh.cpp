// Models from files: the parts put together.
#include "render/load_mesh.h"

#include <cmath>
#include <memory>
#include <new>
#include <stdexcept>
#include <utility>

#include "render/model_folder.h"
#include "render/model_format.h"
#include "render/model_process.h"
#include "render/model_textures.h"

namespace render {
namespace {

Material material_of(const RawMaterial& raw) {
  if (raw.glass) return make_glass_material(raw.name, *raw.glass);
  return make_standard_material(raw.name, raw.parameters);
}

LoadedModel load(const ModelFolder& folder,
                 const LoadOptions& options,
                 const std::stop_token& stop) {
  RawModel raw = read_model_confined(folder, options, stop);
  LoadedModel model;
  for (Mesh& mesh : raw.meshes) {
    model.scene.meshes.push_back(std::make_shared<const Mesh>(std::move(mesh)));
  }
  if (!options.shape_alone) {
    model.scene.textures = decode_textures(raw, folder, stop);
    for (const RawMaterial& material : raw.materials) {
      model.scene.materials.push_back(material_of(material));
    }
  }
  model.scene.instances = std::move(raw.instances);
  model.report = std::move(raw.report);
  model.report.textures = model.scene.textures.size();
  for (const auto& texture : model.scene.textures) {
    model.report.texture_bytes += texture->texels.size();
  }
  return model;
}

}  // namespace

LoadedModel load_model(const std::string& path,
                       const LoadOptions& options,
                       const std::stop_token& stop) {
  if (!(options.scale > 0) || !std::isfinite(options.scale))
    throw std::invalid_argument(path + ": the scale must be above 0");
  if (!(options.emission_gain >= 0) || !std::isfinite(options.emission_gain))
    throw std::invalid_argument(path + ": the emission gain must not be negative");
  if (!model_format(path))
    throw std::runtime_error(
        path + ": models are read from .gltf, .glb, .obj, .ply, .stl, .fbx and .x3d files");
  const ModelFolder folder(path);
  try {
    return load(folder, options, stop);
  } catch (const std::bad_alloc&) {
    throw std::runtime_error(path + ": not enough memory for it");
  } catch (const std::runtime_error& error) {
    const std::string what = error.what();
    if (what.starts_with(path)) throw;
    throw std::runtime_error(path + ": " + what);
  }
}

}  // namespace render
