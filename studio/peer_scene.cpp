// A bench scene as files that other renderers can read.
#include "studio/peer_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "capture/exr.h"
#include "render/glass.h"
#include "render/made_shapes.h"
#include "render/standard.h"
#include "render/transform.h"

namespace studio {
namespace {

using Json = nlohmann::ordered_json;
using render::Mesh;
using render::Vec3f;

constexpr float grey = 0.28125F;  // of the plate: exact in half
constexpr float ball_radius_m = 0.4F;
constexpr Vec3f ball_middle{2.3F, -1.7F, ball_radius_m};

void add_glass_ball(BenchScene& shot) {
  render::SceneDescription scene = shot.scene->description();
  Mesh ball = render::make_cushion({ball_radius_m, ball_radius_m, ball_radius_m}, 2, 48);
  ball.materials = {static_cast<std::uint32_t>(scene.materials.size())};
  scene.materials.push_back(render::make_glass_material("solid glass", {}));
  render::Instance& instance = scene.instances.emplace_back();
  instance.name = "ball";
  instance.mesh = static_cast<std::uint32_t>(scene.meshes.size());
  instance.set_from_object = {1, 0, 0, ball_middle.x, 0, 1, 0, ball_middle.y,
                              0, 0, 1, ball_middle.z};
  scene.meshes.push_back(std::make_shared<const Mesh>(std::move(ball)));
  shot.scene = std::make_unique<render::Scene>(std::move(scene));
}

Json json_of(Vec3f v) { return {v.x, v.y, v.z}; }

Json material_json(const render::Material& material) {
  if (material.shader == "glass") {
    const render::GlassParameters glass = render::glass_parameters(material);
    return {{"name", material.name},
            {"model", "glass"},
            {"index", glass.index},
            {"shadow", glass.shadow}};
  }
  const render::StandardParameters p = render::standard_parameters(material, 0);
  const float gain = p.emission_gain;
  return {{"name", material.name},
          {"model", "standard"},
          {"base", p.base_color},
          {"metallic", p.metallic},
          {"roughness", p.roughness},
          {"specular", p.specular},
          {"coat", p.clearcoat},
          {"coat_roughness", p.clearcoat_roughness},
          {"emission", {gain * p.emission[0], gain * p.emission[1], gain * p.emission[2]}}};
}

void write_file(const std::filesystem::path& path, const std::string& bytes) {
  std::ofstream file(path, std::ios::binary);
  file << bytes;
  file.close();
  if (!file)
    throw std::runtime_error("cannot write " + path.string() + ": " + std::strerror(errno));
}

template <class T>
void append_bytes(std::string& bytes, T value) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), &value, sizeof(T));
  bytes.append(raw.data(), raw.size());
}

// Little-endian, as this machine is (capture/bytes.h asks for it as well).
std::string ply_of(const Mesh& mesh) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.positions.size(), mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    for (const Vec3f v : {mesh.positions[i], mesh.normals[i]}) {
      for (const float value : {v.x, v.y, v.z}) append_bytes(bytes, value);
    }
  }
  for (const auto& triangle : mesh.triangles) {
    append_bytes(bytes, std::uint8_t{3});
    for (const std::uint32_t corner : triangle) append_bytes(bytes, corner);
  }
  return bytes;
}

}  // namespace

const std::vector<std::string>& peer_scene_names() {
  static const std::vector<std::string> names{"matte", "paint", "glass"};
  return names;
}

PeerScene make_peer_scene(const std::string& name, int width, int height) {
  if (std::ranges::find(peer_scene_names(), name) == peer_scene_names().end()) {
    throw std::invalid_argument(
        fmt::format("there is no scene \"{}\" to compare: there are matte, paint and glass", name));
  }
  const bool matte = name == "matte";
  PeerScene made{make_bench_scene(width, height, matte ? BenchFinish::matte : BenchFinish::real),
                 matte};
  if (name == "glass") add_glass_ball(made.shot);
  std::ranges::fill(made.shot.plate.pixels, grey);
  made.shot.half_plate = capture::to_half(made.shot.plate);
  return made;
}

Mesh triangles_of_material(const render::SceneDescription& scene, std::uint32_t material) {
  Mesh part;
  part.materials = {material};
  for (const render::Instance& instance : scene.instances) {
    if (instance.kind != render::ObjectKind::virtual_object) continue;
    const Mesh& mesh = *scene.meshes[instance.mesh];
    const auto turn = render::normal_matrix(instance.set_from_object);
    std::map<std::uint32_t, std::uint32_t> moved;
    const auto add = [&](std::uint32_t vertex, Vec3f normal) {
      part.positions.push_back(
          render::transform_point(instance.set_from_object, mesh.positions[vertex]));
      part.normals.push_back(render::transform_normal(turn, normal));
      return static_cast<std::uint32_t>(part.positions.size() - 1);
    };
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const std::uint32_t own = mesh.materials.size() == 1 ? mesh.materials[0] : mesh.materials[t];
      if (own != material) continue;
      const auto& corners = mesh.triangles[t];
      std::array<std::uint32_t, 3> triangle{};
      for (std::size_t i = 0; i < 3; ++i) {
        if (mesh.normals.empty()) {
          triangle[i] =
              add(corners[i], cross(mesh.positions[corners[1]] - mesh.positions[corners[0]],
                                    mesh.positions[corners[2]] - mesh.positions[corners[0]]));
        } else {
          const auto [at, is_new] = moved.try_emplace(corners[i], 0);
          if (is_new) at->second = add(corners[i], mesh.normals[corners[i]]);
          triangle[i] = at->second;
        }
      }
      // Others take the winding for the outside, where here the normals tell it.
      const auto& at = part.positions;
      const auto [i, j, k] = triangle;
      const Vec3f outside = part.normals[i] + part.normals[j] + part.normals[k];
      if (dot(cross(at[j] - at[i], at[k] - at[i]), outside) < 0) {
        std::swap(triangle[1], triangle[2]);
      }
      part.triangles.push_back(triangle);
    }
  }
  return part;
}

void write_peer_scene(const PeerScene& scene, const std::filesystem::path& directory) {
  std::filesystem::create_directories(directory);
  const BenchScene& shot = scene.shot;
  const render::SceneDescription& description = shot.scene->description();
  Json parts = Json::array();
  for (std::uint32_t m = 0; m < description.materials.size(); ++m) {
    if (description.materials[m].shader == "stand_in") continue;
    const Mesh mesh = triangles_of_material(description, m);
    if (mesh.triangles.empty()) continue;
    const std::string file = fmt::format("material_{}.ply", m);
    write_file(directory / file, ply_of(mesh));
    Json part = material_json(description.materials[m]);
    part["file"] = file;
    parts.push_back(part);
  }
  capture::write_exr((directory / "light.exr").string(), shot.environment.radiance);
  const calibrate::Pose set_from_cam = inverse(shot.job.cam_from_set);
  Json rotation = Json::array();
  for (const double entry : set_from_cam.R.m) rotation.push_back(entry);
  const Vec3f open = render::irradiance_of(shot.environment, {0, 0, 1});
  const Vec3f plate{shot.plate.at(0, 0, 0), shot.plate.at(0, 0, 1), shot.plate.at(0, 0, 2)};
  constexpr float pi = std::numbers::pi_v<float>;
  const Json json{
      {"width", shot.directions.width},
      {"height", shot.directions.height},
      {"focal_px", shot.lens.parameters[0]},
      {"camera",
       {{"position", {set_from_cam.t.x, set_from_cam.t.y, set_from_cam.t.z}},
        {"set_from_cam", rotation}}},
      {"light", "light.exr"},
      {"direct_light_only", scene.direct_light_only},
      {"plate", json_of(plate)},
      {"floor_albedo", json_of(Vec3f{plate.x / open.x, plate.y / open.y, plate.z / open.z} * pi)},
      {"parts", parts}};
  write_file(directory / "scene.json", json.dump(2) + "\n");
}

}  // namespace studio
