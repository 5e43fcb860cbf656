// Models of one triangle, as the bytes of files of each format; also damaged ones.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace made {

using namespace std::string_literals;

template <class T>
void put(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}
template <class T>
inline std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

inline std::string number(float x) {
  return std::isnan(x) ? "nan" : std::isinf(x) ? "inf" : std::to_string(x);
}

inline std::string glb(const std::string& json, const std::string& binary) {
  std::string text = json;
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string file = "glTF";
  for (const std::size_t word : {std::size_t{2}, 28 + text.size() + binary.size(), text.size()})
    put(file, static_cast<std::uint32_t>(word));
  file += "JSON" + text;
  put(file, static_cast<std::uint32_t>(binary.size()));
  return file + "BIN\0"s + binary;
}

struct GlbParts {
  std::vector<float> positions{0, 0, 0, 1, 0, 0, 0, 1, 0};
  std::vector<float> normals{0, 0, 1, 0, 0, 1, 0, 0, 1};
  std::vector<float> uvs{0, 0, 1, 0, 0, 1};
  std::vector<std::uint32_t> indices{0, 1, 2};
  std::string material = "{}";
  std::string more;  // members of the document
};

inline std::string make_glb(const GlbParts& parts) {
  const std::string binary = bytes_of(parts.positions) + bytes_of(parts.normals) +
                             bytes_of(parts.uvs) + bytes_of(parts.indices);
  return glb(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"name":"part","mesh":0}],"meshes":[{"primitives":[{"attributes":
{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2},"indices":3,"material":0}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},
{"bufferView":0,"byteOffset":36,"componentType":5126,"count":3,"type":"VEC3"},
{"bufferView":0,"byteOffset":72,"componentType":5126,"count":3,"type":"VEC2"},
{"bufferView":0,"byteOffset":96,"componentType":5125,"count":3,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteLength":)" +
                 std::to_string(binary.size()) + R"(}],"buffers":[{"byteLength":)" +
                 std::to_string(binary.size()) + R"(}],"materials":[)" + parts.material + "]" +
                 parts.more + "}",
             binary);
}

// The triangle has the corners (0, 0, 0), (1, 0, 0) and `apex`.
inline std::string stl(const std::vector<float>& apex, std::uint32_t claimed = 1) {
  std::string file(80, ' ');
  put(file, claimed);
  for (const float x : {0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F}) put(file, x);
  for (const float x : apex) put(file, x);
  put(file, std::uint16_t{0});
  return file;
}

inline std::string ply_head(const std::string& vertices,
                            const std::string& faces,
                            const std::string& format) {
  return "ply\nformat "s + format + " 1.0\nelement vertex " + vertices +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " + faces +
         "\nproperty list uchar int vertex_indices\nend_header\n";
}

inline std::string ascii_ply(const std::vector<float>& apex) {
  return ply_head("3", "1", "ascii") + "0 0 0\n1 0 0\n" + number(apex[0]) + " " + number(apex[1]) +
         " " + number(apex[2]) + "\n3 0 1 2\n";
}

inline std::string binary_ply(const std::vector<float>& apex, std::uint32_t last = 2) {
  std::string file = ply_head("3", "1", "binary_little_endian");
  for (const float x : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F}) put(file, x);
  for (const float x : apex) put(file, x);
  file += '\3';
  for (const std::uint32_t index : {0U, 1U, last}) put(file, index);
  return file;
}

inline std::string obj(const std::vector<float>& apex) {
  return "v 0 0 0\nv 1 0 0\nv " + number(apex[0]) + " " + number(apex[1]) + " " + number(apex[2]) +
         "\nf 1 2 3\n";
}

inline std::string x3d(const std::string& scene) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<X3D profile=\"Interchange\" "
         "version=\"3.0\"><Scene>" +
         scene + "</Scene></X3D>\n";
}
inline std::string x3d_triangle(const std::string& indices, const std::string& points) {
  return x3d("<Shape><IndexedFaceSet coordIndex=\"" + indices + "\"><Coordinate point=\"" + points +
             "\"/></IndexedFaceSet></Shape>");
}

}  // namespace made
