// Binary glTF files of a few vertices, put together piece by piece.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

#include "tests/made_model_bytes.h"

namespace made {

class GltfMaker {
 public:
  // A view of these bytes; its index.
  int view(const std::string& bytes, std::size_t stride = 0) {
    views_ += (views_.empty() ? "" : ",") + R"({"buffer":0,"byteOffset":)"s +
              std::to_string(buffer_.size()) + ",\"byteLength\":" + std::to_string(bytes.size());
    if (stride > 0) views_ += ",\"byteStride\":" + std::to_string(stride);
    views_ += "}";
    buffer_ += bytes;
    buffer_.resize((buffer_.size() + 3) / 4 * 4);
    return view_count_++;
  }

  // An accessor of rows of `wide` values, `stride` bytes apart where that is above 0, with more
  // members; its index.
  template <class T>
  int values(int wide,
             const std::vector<T>& all,
             const std::string& more = "",
             std::size_t stride = 0) {
    const auto row = static_cast<std::size_t>(wide);
    std::string bytes;
    for (std::size_t i = 0; i < all.size(); ++i) {
      put(bytes, all[i]);
      if (stride > 0 && i % row == row - 1) bytes.resize((i / row + 1) * stride);
    }
    return accessor(type_of<T>(), wide, all.size() / row,
                    ",\"bufferView\":" + std::to_string(view(bytes, stride)) + more);
  }
  int accessor(int type, int wide, std::size_t count, const std::string& more) {
    const char* kinds[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
    accessors_ += (accessors_.empty() ? "" : ",") + "{\"componentType\":"s + std::to_string(type) +
                  ",\"type\":\"" + (wide == 16 ? "MAT4" : kinds[wide]) +
                  "\",\"count\":" + std::to_string(count) + more + "}";
    return accessor_count_++;
  }

  // The file; `members` are those of the document but for what is above, and a scene of node 0.
  std::string glb(const std::string& members) const {
    return made::glb(
        R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"accessors":[)" +
            accessors_ + "],\"bufferViews\":[" + views_ + "],\"buffers\":[{\"byteLength\":" +
            std::to_string(buffer_.size()) + "}]," + members + "}",
        buffer_);
  }

 private:
  template <class T>
  static int type_of() {
    const int by_size = sizeof(T) == 1 ? 5120 : sizeof(T) == 2 ? 5122 : 5124;
    return std::is_floating_point_v<T> ? 5126 : by_size + (std::is_unsigned_v<T> ? 1 : 0);
  }

  std::string buffer_, views_, accessors_;
  int view_count_ = 0, accessor_count_ = 0;
};

}  // namespace made
