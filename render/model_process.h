// Models read by a helper program under limits, since a damaged file may crash or hang what reads
// it.
#pragma once

#include <cstddef>
#include <stop_token>
#include <string>
#include <vector>

#include "render/load_mesh.h"
#include "render/model_folder.h"
#include "render/raw_model.h"

namespace render {

// Has platelight-model read the folder's model, under limits that grow with its files: 512 MB and
// 5 s of processor time, plus 24 bytes and 1 microsecond a byte. Throws std::runtime_error with
// the reason (not the file) if it cannot be read, is damaged, or needs more than that,
// std::invalid_argument if `hide` names a node that is not there. Once a stop is requested, it soon
// throws std::runtime_error.
RawModel read_model_confined(const ModelFolder& folder,
                             const LoadOptions& options,
                             const std::stop_token& stop = {});

// The options as they travel.
std::vector<std::byte> write_request(const std::string& file, const LoadOptions& options);
LoadOptions parse_request(std::span<const std::byte> bytes, std::string& file);

}  // namespace render
