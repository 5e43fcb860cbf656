// Models between the process that reads them and ours.
#include "render/raw_model.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <type_traits>

#include "render/transform.h"

namespace render {
namespace {

constexpr std::uint64_t max_vertices = 3 * std::uint64_t{max_model_triangles};
constexpr std::uint64_t max_embedded_bytes = std::uint64_t{2} << 30;

// A block of plain numbers.
template <class T>
void put_block(ByteWriter& out, const T& block) {
  static_assert(std::is_trivially_copyable_v<T>);
  out.put_all(std::span(&block, 1));
}
template <class T>
T get_block(ByteReader& in) {
  std::vector<T> block;
  in.get_all(block);
  if (block.size() != 1) in.fail("is damaged");
  return block[0];
}

void put_texts(ByteWriter& out, const std::vector<std::string>& texts) {
  out.put(static_cast<std::uint64_t>(texts.size()));
  for (const std::string& text : texts) out.put_text(text);
}
std::vector<std::string> get_texts(ByteReader& in) {
  std::vector<std::string> texts;
  for (std::size_t n = in.get_count(sizeof(std::uint64_t)); n > 0; --n) {
    texts.push_back(in.get_text());
  }
  return texts;
}

void put_report(ByteWriter& out, const LoadReport& report) {
  for (const std::size_t count : {report.triangles, report.vertices, report.materials}) {
    out.put(static_cast<std::uint64_t>(count));
  }
  put_texts(out, report.nodes);
  put_texts(out, report.notes);
  put_block(out, report.lower);
  put_block(out, report.upper);
}
void get_report(ByteReader& in, LoadReport& report) {
  for (std::size_t* count : {&report.triangles, &report.vertices, &report.materials}) {
    *count = static_cast<std::size_t>(in.get<std::uint64_t>());
  }
  report.nodes = get_texts(in);
  report.notes = get_texts(in);
  report.lower = get_block<Vec3f>(in);
  report.upper = get_block<Vec3f>(in);
}

void check(const RawModel& model, const RawSizes& sizes, const ByteReader& in) {
  for (const Mesh& mesh : model.meshes) {
    if (mesh.materials.at(0) >= model.materials.size())
      in.fail("names a material that is not there");
  }
  std::uint64_t vertices = 0, triangles = 0, embedded = 0;
  for (const RawSizes::OfMesh& mesh : sizes.meshes) {
    const std::uint64_t own = mesh.of_vertices[0];
    const auto fits = [own](std::uint64_t count) { return count == 0 || count == own; };
    if (own > max_vertices || mesh.triangles > max_model_triangles ||
        !std::ranges::all_of(mesh.of_vertices, fits)) {
      in.fail("has arrays of wrong lengths");
    }
    vertices += own;
    triangles += mesh.triangles;
    if (vertices > max_vertices || triangles > max_model_triangles) in.fail("is too large");
  }
  for (const std::uint64_t bytes : sizes.textures) {
    if (bytes > max_embedded_bytes || (embedded += bytes) > max_embedded_bytes) {
      in.fail("has more than 2 GB of embedded textures");
    }
  }
  triangles = 0;
  for (const Instance& instance : model.instances) {
    if (instance.mesh >= model.meshes.size()) in.fail("names a mesh that is not there");
    triangles += sizes.meshes[instance.mesh].triangles;
    if (triangles > max_model_triangles) in.fail("is too large");
    if (!std::ranges::all_of(instance.set_from_object, [](float x) { return std::isfinite(x); })) {
      in.fail("has a transform that is not finite");
    }
  }
}

}  // namespace

std::vector<std::byte> write_head(const RawModel& model) {
  ByteWriter out;
  put_report(out, model.report);
  out.put(static_cast<std::uint64_t>(model.meshes.size()));
  for (const Mesh& mesh : model.meshes) {
    RawSizes::OfMesh sizes{{}, mesh.triangles.size()};
    std::uint64_t* count = sizes.of_vertices.data();
    for_each_vertex_array(mesh, [&](const auto& values) { *count++ = values.size(); });
    put_block(out, sizes);
    out.put(mesh.materials.at(0));
  }
  out.put(static_cast<std::uint64_t>(model.materials.size()));
  for (const RawMaterial& material : model.materials) {
    out.put_text(material.name);
    put_block(out, material.parameters);
    out.put(static_cast<std::uint8_t>(material.glass.has_value()));
    put_block(out, material.glass.value_or(GlassParameters{}));
  }
  out.put(static_cast<std::uint64_t>(model.textures.size()));
  for (const RawTexture& texture : model.textures) {
    out.put_text(texture.name);
    out.put(static_cast<std::uint8_t>(texture.srgb));
    out.put(static_cast<std::uint8_t>(texture.embedded));
    for (const Wrap wrap : texture.wrap) out.put(wrap);
    out.put(texture.width);
    out.put(texture.height);
    out.put(static_cast<std::uint64_t>(texture.bytes.size()));
  }
  out.put(static_cast<std::uint64_t>(model.instances.size()));
  for (const Instance& instance : model.instances) {
    out.put_text(instance.name);
    out.put(instance.mesh);
    put_block(out, instance.set_from_object);
  }
  return out.take();
}

RawSizes parse_head(std::span<const std::byte> bytes, RawModel& model) {
  ByteReader in(bytes, "what its reader sends");
  RawSizes sizes;
  get_report(in, model.report);
  for (std::size_t n = in.get_count(sizeof(RawSizes::OfMesh)); n > 0; --n) {
    sizes.meshes.push_back(get_block<RawSizes::OfMesh>(in));
    model.meshes.emplace_back().materials = {in.get<std::uint32_t>()};
  }
  for (std::size_t n = in.get_count(sizeof(StandardParameters)); n > 0; --n) {
    RawMaterial& material = model.materials.emplace_back();
    material.name = in.get_text();
    material.parameters = get_block<StandardParameters>(in);
    const bool glass = in.get<std::uint8_t>() != 0;
    const auto parameters = get_block<GlassParameters>(in);
    if (glass) material.glass = parameters;
  }
  for (std::size_t n = in.get_count(sizeof(std::uint64_t)); n > 0; --n) {
    RawTexture& texture = model.textures.emplace_back();
    texture.name = in.get_text();
    texture.srgb = in.get<std::uint8_t>() != 0;
    texture.embedded = in.get<std::uint8_t>() != 0;
    for (Wrap& wrap : texture.wrap) {
      wrap = in.get<Wrap>();
      if (wrap > Wrap::mirror) in.fail("has a texture that goes on in no known way");
    }
    in.get(texture.width);
    in.get(texture.height);
    sizes.textures.push_back(in.get<std::uint64_t>());
  }
  for (std::size_t n = in.get_count(12 * sizeof(float)); n > 0; --n) {
    Instance& instance = model.instances.emplace_back();
    instance.name = in.get_text();
    in.get(instance.mesh);
    instance.set_from_object = get_block<std::array<float, 12>>(in);
  }
  in.expect_end();
  check(model, sizes, in);
  return sizes;
}

void check_arrays(const Mesh& mesh) {
  const std::size_t count = mesh.positions.size();
  const auto finite = [](Vec3f v) { return is_finite(v); };
  bool sound =
      std::ranges::all_of(mesh.positions, finite) && std::ranges::all_of(mesh.normals, finite);
  for (const auto* uvs : {&mesh.uvs, &mesh.second_uvs}) {
    for (const auto& [u, v] : *uvs) sound = sound && std::isfinite(u) && std::isfinite(v);
  }
  for (const auto& tangent : mesh.tangents) {
    for (const float x : tangent) sound = sound && std::isfinite(x);
  }
  for (const auto& [a, b, c] : mesh.triangles) sound = sound && a < count && b < count && c < count;
  if (!sound) throw std::runtime_error("what its reader sends is no mesh");
}

}  // namespace render
