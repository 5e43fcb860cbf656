// Textures of a model, decoded; what is missing, replaced.
#pragma once

#include <memory>
#include <stop_token>
#include <vector>

#include "render/model_folder.h"
#include "render/raw_model.h"

namespace render {

// The model's textures, decoded in parallel; its materials then name those. A texture that is not
// there or cannot be decoded is told in the report's notes and in its place: base colour becomes
// linear (1, 0, 1), emission and transmission 0, other maps are left out. Throws
// std::runtime_error if a material refers to anything outside the model's folder, or all textures
// together take more than 4 GB with their mip levels; decodes none then; or, soon, once a stop is
// requested.
std::vector<std::shared_ptr<const Texture>> decode_textures(RawModel& model,
                                                            const ModelFolder& folder,
                                                            const std::stop_token& stop = {});

}  // namespace render
