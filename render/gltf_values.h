// The values of a glTF file's accessors.
#pragma once

#include <cstddef>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace render {

// All bytes of a file that the model names so; nothing if it is not there.
using ReadGltfFile = std::function<std::optional<std::vector<std::byte>>(const std::string&)>;

// A whole number at or above 0; throws std::runtime_error if it is none.
std::size_t gltf_index(const nlohmann::json& value);
// A member that is one, or `otherwise` if it is not there.
std::size_t gltf_index(const nlohmann::json& object, const char* key, std::size_t otherwise);
// The member, or null.
const nlohmann::json& gltf_member(const nlohmann::json& object, const char* key);
// How many components the accessor's values have.
std::size_t gltf_components(const nlohmann::json& accessor);

// Reads accessors of a document that has passed check_gltf.
class GltfValues {
 public:
  // `document` must outlive this; its accessors and views may grow. `binary` is a .glb's second
  // chunk with what follows it, or empty.
  GltfValues(const nlohmann::json& document, std::span<const std::byte> binary)
      : document_(document), binary_(binary) {}

  // False if a buffer is not there.
  bool read_buffers(const ReadGltfFile& read);

  // All components of an accessor, sparse ones in their places, normalized ones from -1 or 0 to 1;
  // an accessor without a view is 0. Throws std::runtime_error, naming the place in the file, if it
  // reaches beyond its buffer or is not there.
  std::vector<float> floats(std::size_t accessor) const;

 private:
  const std::byte* pieces(const nlohmann::json& of,
                          std::size_t view,
                          std::size_t count,
                          std::size_t size,
                          std::size_t step) const;
  void change(const nlohmann::json& accessor, std::vector<float>& values) const;

  const nlohmann::json& document_;
  std::span<const std::byte> binary_;
  std::vector<std::vector<std::byte>> buffers_;
};

}  // namespace render
