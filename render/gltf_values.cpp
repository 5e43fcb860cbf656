// The values of a glTF file's accessors.
#include "render/gltf_values.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>

namespace render {
namespace {

using nlohmann::json;

std::vector<std::byte> from_base64(std::string_view text) {
  std::vector<std::byte> bytes;
  bytes.reserve(text.size() / 4 * 3);
  unsigned bits = 0, count = 0;
  for (const char c : text) {
    const int value = c >= 'A' && c <= 'Z'   ? c - 'A'
                      : c >= 'a' && c <= 'z' ? c - 'a' + 26
                      : c >= '0' && c <= '9' ? c - '0' + 52
                      : c == '+'             ? 62
                      : c == '/'             ? 63
                                             : -1;
    if (value < 0) continue;  // padding, or a line's end
    bits = bits << 6U | static_cast<unsigned>(value);
    if ((count += 6) < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<std::byte>(bits >> count));
  }
  return bytes;
}

enum Component : std::size_t {
  signed_byte = 5120,
  unsigned_byte,
  signed_short,
  unsigned_short,
  unsigned_int = 5125
};

std::size_t component_size(std::size_t type) {
  if (type == signed_byte || type == unsigned_byte) return 1;
  return type == signed_short || type == unsigned_short ? 2 : 4;
}

template <class T>
T value_at(const std::byte* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

// A normalized integer's share of the most that its type holds; the least is no less than -1.
template <class T>
float integer_at(const std::byte* bytes, bool normalized) {
  const auto value = static_cast<float>(value_at<T>(bytes));
  return normalized ? std::max(value / static_cast<float>(std::numeric_limits<T>::max()), -1.0F)
                    : value;
}

float component_at(const std::byte* bytes, std::size_t type, bool normalized) {
  switch (type) {
    case signed_byte:
      return integer_at<std::int8_t>(bytes, normalized);
    case unsigned_byte:
      return integer_at<std::uint8_t>(bytes, normalized);
    case signed_short:
      return integer_at<std::int16_t>(bytes, normalized);
    case unsigned_short:
      return integer_at<std::uint16_t>(bytes, normalized);
    case unsigned_int:
      return integer_at<std::uint32_t>(bytes, normalized);
    default:
      return value_at<float>(bytes);
  }
}

// Copies one value of an accessor, all its components.
void copy_value(const json& accessor, const std::byte* from, std::span<float> to) {
  const std::size_t type = gltf_index(accessor.at("componentType"));
  const bool normalized = gltf_member(accessor, "normalized") == true;
  for (std::size_t k = 0; k < to.size(); ++k) {
    to[k] = component_at(from + k * component_size(type), type, normalized);
  }
}

}  // namespace

std::size_t gltf_index(const json& value) {
  if (!value.is_number_unsigned()) throw std::runtime_error("an index is no whole number");
  return value.get<std::size_t>();
}

std::size_t gltf_index(const json& object, const char* key, std::size_t otherwise) {
  const json& found = gltf_member(object, key);
  return found.is_null() ? otherwise : gltf_index(found);
}

const json& gltf_member(const json& object, const char* key) {
  static const json none;
  if (!object.is_object()) return none;
  const auto found = object.find(key);
  return found == object.end() ? none : *found;
}

std::size_t gltf_components(const json& accessor) {
  const auto type = accessor.at("type").get<std::string>();
  if (type == "SCALAR") return 1;
  if (type == "MAT4") return 16;
  if (type == "MAT3") return 9;
  return type == "MAT2" ? 4 : static_cast<std::size_t>(type.back() - '0');
}

bool GltfValues::read_buffers(const ReadGltfFile& read) {
  for (const json& buffer : gltf_member(document_, "buffers")) {
    std::vector<std::byte>& bytes = buffers_.emplace_back();
    const json& uri = gltf_member(buffer, "uri");
    if (uri.is_null()) {
      constexpr std::size_t head = 8;
      if (binary_.size() > head) bytes.assign(binary_.begin() + head, binary_.end());
      continue;
    }
    const auto& text = uri.get_ref<const std::string&>();
    if (text.starts_with("data:")) {
      bytes = from_base64(std::string_view(text).substr(text.find(',') + 1));
    } else if (auto file = read(text)) {
      bytes = std::move(*file);
    } else {
      return false;
    }
  }
  return true;
}

// The first of `count` pieces of `size` bytes, `step` bytes apart, of a view, from of's byteOffset.
const std::byte* GltfValues::pieces(
    const json& of, std::size_t view, std::size_t count, std::size_t size, std::size_t step) const {
  const std::string where = "bufferView " + std::to_string(view);
  const json& views = gltf_member(document_, "bufferViews");
  if (view >= views.size()) throw std::runtime_error(where + " is not there");
  const std::vector<std::byte>& buffer = buffers_.at(gltf_index(views[view], "buffer", 0));
  const std::size_t begin = gltf_index(views[view], "byteOffset", 0);
  const std::size_t length = gltf_index(views[view], "byteLength", 0);
  const std::size_t offset = gltf_index(of, "byteOffset", 0);
  if (begin > buffer.size() || length > buffer.size() - begin)
    throw std::runtime_error(where + " reaches beyond its buffer");
  if (count == 0) return buffer.data();
  if (offset > length || size > length - offset || (count - 1) * step > length - offset - size)
    throw std::runtime_error(where + " is shorter than what is read of it");
  return buffer.data() + begin + offset;
}

std::vector<float> GltfValues::floats(std::size_t index) const {
  const json& accessors = gltf_member(document_, "accessors");
  if (index >= accessors.size())
    throw std::runtime_error("accessor " + std::to_string(index) + " is not there");
  const json& accessor = accessors[index];
  const std::size_t wide = gltf_components(accessor);
  const std::size_t size = wide * component_size(gltf_index(accessor.at("componentType")));
  const std::size_t count = gltf_index(accessor, "count", 0);
  std::vector<float> values(wide * count);
  if (accessor.contains("bufferView") && count > 0) {
    const std::size_t view = gltf_index(accessor["bufferView"]);
    const std::size_t step = gltf_index(gltf_member(document_, "bufferViews").at(view),
                                        "byteStride", size);  // checked with the file
    const std::byte* from = pieces(accessor, view, count, size, step);
    for (std::size_t i = 0; i < count; ++i) {
      copy_value(accessor, from + i * step, std::span(values).subspan(i * wide, wide));
    }
  }
  if (accessor.contains("sparse")) change(accessor, values);
  return values;
}

void GltfValues::change(const json& accessor, std::vector<float>& values) const {
  const json& sparse = accessor.at("sparse");
  const json &places = sparse.at("indices"), &others = sparse.at("values");
  const std::size_t wide = gltf_components(accessor);
  const std::size_t count = values.size() / wide, changes = gltf_index(sparse, "count", 0);
  if (changes > count) throw std::runtime_error("a sparse accessor changes more than it holds");
  const std::size_t size = wide * component_size(gltf_index(accessor.at("componentType")));
  const std::size_t place_size = component_size(gltf_index(places.at("componentType")));
  const std::byte* place =
      pieces(places, gltf_index(places.at("bufferView")), changes, place_size, place_size);
  const std::byte* from = pieces(others, gltf_index(others.at("bufferView")), changes, size, size);
  for (std::size_t k = 0; k < changes; ++k) {
    std::uint32_t target = 0;
    std::memcpy(&target, place + k * place_size, place_size);
    if (target >= count)
      throw std::runtime_error("a sparse accessor changes value " + std::to_string(target) +
                               " of " + std::to_string(count));
    copy_value(accessor, from + k * size, std::span(values).subspan(target * wide, wide));
  }
}

}  // namespace render
