// Scene descriptions as bytes.
#include "render/bytes.h"
#include "render/scene.h"

namespace render {
namespace {

constexpr std::uint32_t scene_magic = 0x41435350;  // "PSCA"

void put(ByteWriter& out, const Mesh& mesh) {
  for_each_vertex_array(mesh, [&](const auto& values) { out.put_all(values); });
  out.put_all(mesh.triangles);
  out.put_all(mesh.materials);
  out.put(static_cast<std::uint8_t>(mesh.rest != nullptr));
  if (mesh.rest) out.put_all(*mesh.rest);
}

Mesh get_mesh(ByteReader& in) {
  Mesh mesh;
  for_each_vertex_array(mesh, [&](auto& values) { in.get_all(values); });
  in.get_all(mesh.triangles);
  in.get_all(mesh.materials);
  if (in.get<std::uint8_t>() != 0) {
    std::vector<Vec3f> rest;
    in.get_all(rest);
    mesh.rest = std::make_shared<const std::vector<Vec3f>>(std::move(rest));
  }
  return mesh;
}

// Texels of all mip levels of a texture.
std::size_t texel_bytes(const Texture& texture) {
  std::size_t total = 0;
  int width = texture.width, height = texture.height;
  while (true) {
    total += static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
             static_cast<std::size_t>(texture.channels);
    if (width == 1 && height == 1) return total;
    width = width > 1 ? width / 2 : 1;
    height = height > 1 ? height / 2 : 1;
  }
}

Texture get_texture(ByteReader& in) {
  Texture texture;
  in.get(texture.width);
  in.get(texture.height);
  in.get(texture.channels);
  texture.srgb = in.get<std::uint8_t>() != 0;
  for (Wrap& wrap : texture.wrap) {
    wrap = in.get<Wrap>();
    if (wrap > Wrap::mirror) in.fail("has a texture that goes on in no known way");
  }
  in.get_all(texture.texels);
  constexpr int limit = 1 << 15;
  if (texture.width < 1 || texture.height < 1 || texture.width > limit || texture.height > limit ||
      texture.channels < 1 || texture.channels > 4) {
    in.fail("has a texture of an impossible size");
  }
  if (texture.texels.size() != texel_bytes(texture))
    in.fail("has a texture without all its texels");
  return texture;
}

}  // namespace

std::vector<std::byte> serialize(const SceneDescription& scene) {
  ByteWriter out;
  out.put(scene_magic);
  out.put(scene.version);
  out.put_text(scene.background);
  out.put(static_cast<std::uint64_t>(scene.meshes.size()));
  for (const auto& mesh : scene.meshes) put(out, *mesh);
  out.put(static_cast<std::uint64_t>(scene.textures.size()));
  for (const auto& texture : scene.textures) {
    out.put(texture->width), out.put(texture->height), out.put(texture->channels);
    out.put(static_cast<std::uint8_t>(texture->srgb));
    for (const Wrap wrap : texture->wrap) out.put(wrap);
    out.put_all(texture->texels);
  }
  out.put(static_cast<std::uint64_t>(scene.videos.size()));
  for (const std::string& video : scene.videos) out.put_text(video);
  out.put(static_cast<std::uint64_t>(scene.materials.size()));
  for (const Material& material : scene.materials) {
    out.put_text(material.name);
    out.put_text(material.shader);
    out.put_all(material.parameters);
  }
  out.put(static_cast<std::uint64_t>(scene.instances.size()));
  for (const Instance& instance : scene.instances) {
    out.put_text(instance.name);
    out.put(instance.mesh);
    for (const float value : instance.set_from_object) out.put(value);
    out.put(instance.kind);
    out.put(static_cast<std::uint8_t>(instance.blocks_light));
    out.put(static_cast<std::uint8_t>(instance.occludes));
    out.put(static_cast<std::uint8_t>(instance.mirrored));
    out.put(static_cast<std::uint8_t>(instance.moves));
  }
  return out.take();
}

SceneDescription parse_scene(std::span<const std::byte> bytes) {
  ByteReader in(bytes, "scene");
  if (in.get<std::uint32_t>() != scene_magic) in.fail("is of another kind or version");
  SceneDescription scene;
  in.get(scene.version);
  scene.background = in.get_text();
  constexpr std::size_t count_size = sizeof(std::uint64_t);
  for (std::size_t n = in.get_count(6 * count_size + 1); n > 0; --n) {
    scene.meshes.push_back(std::make_shared<const Mesh>(get_mesh(in)));
  }
  for (std::size_t n = in.get_count(3 * sizeof(int) + 1 + count_size); n > 0; --n) {
    scene.textures.push_back(std::make_shared<const Texture>(get_texture(in)));
  }
  for (std::size_t n = in.get_count(count_size); n > 0; --n) scene.videos.push_back(in.get_text());
  for (std::size_t n = in.get_count(3 * count_size); n > 0; --n) {
    Material& material = scene.materials.emplace_back();
    material.name = in.get_text();
    material.shader = in.get_text();
    in.get_all(material.parameters);
  }
  for (std::size_t n = in.get_count(count_size + 4 + 12 * 4 + 4); n > 0; --n) {
    Instance& instance = scene.instances.emplace_back();
    instance.name = in.get_text();
    in.get(instance.mesh);
    for (float& value : instance.set_from_object) in.get(value);
    const auto kind = in.get<std::uint8_t>();
    if (kind > static_cast<std::uint8_t>(ObjectKind::stand_in))
      in.fail("has an unknown object kind");
    instance.kind = static_cast<ObjectKind>(kind);
    instance.blocks_light = in.get<std::uint8_t>() != 0;
    instance.occludes = in.get<std::uint8_t>() != 0;
    instance.mirrored = in.get<std::uint8_t>() != 0;
    instance.moves = in.get<std::uint8_t>() != 0;
  }
  in.expect_end();
  return scene;
}

}  // namespace render
