// The papers' scenes: as many triangles, all of them sound, and what stands where it must.
#include "render/paper_scenes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <string>

#include <gmock/gmock.h>

#include "capture/parallel_loop.h"
#include "render/made_headlight.h"
#include "render/made_stage.h"
#include "render/made_tv_room.h"
#include "render/standard.h"
#include "render/trace.h"

namespace render::paper_scenes_test {
namespace {

const PaperScene& made(const std::string& name) {
  static std::map<std::string, PaperScene> scenes;
  const auto [at, is_new] = scenes.try_emplace(name);
  if (is_new) at->second = made_paper_scene(name);
  return at->second;
}

Vec3f in_set(const Instance& instance, Vec3f p) {
  const auto& m = instance.set_from_object;
  return {m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7],
          m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]};
}

std::array<Vec3f, 3> corners_of(const SceneDescription& scene,
                                const Instance& instance,
                                std::size_t triangle) {
  const Mesh& mesh = *scene.meshes[instance.mesh];
  std::array<Vec3f, 3> corners;
  for (std::size_t i = 0; i < 3; ++i)
    corners[i] = in_set(instance, mesh.positions[mesh.triangles[triangle][i]]);
  return corners;
}

const Instance& part(const SceneDescription& scene, const std::string& name) {
  const auto found = std::ranges::find(scene.instances, name, &Instance::name);
  if (found == scene.instances.end()) throw std::runtime_error("no part " + name);
  return *found;
}

const Mesh& mesh_of(const SceneDescription& scene, const std::string& name) {
  return *scene.meshes[part(scene, name).mesh];
}

// Signed volume of a mesh if each edge belongs to two of its triangles, once each way; else 0.
// Points of the same place are one.
double closed_volume(const Mesh& mesh) {
  std::map<std::array<float, 3>, std::uint32_t> places;
  std::vector<std::uint32_t> place(mesh.positions.size());
  for (std::size_t i = 0; i < place.size(); ++i) {
    const Vec3f p = mesh.positions[i];
    const auto next = static_cast<std::uint32_t>(places.size());
    place[i] = places.try_emplace({p.x, p.y, p.z}, next).first->second;
  }
  std::vector<std::uint64_t> edges;
  double volume = 0;
  const auto edge = [](std::uint64_t a, std::uint64_t b) { return a << 32U | b; };
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) edges.push_back(edge(place[t[i]], place[t[(i + 1) % 3]]));
    volume += dot(calibrate::to_double(mesh.positions[t[0]]),
                  cross(calibrate::to_double(mesh.positions[t[1]]),
                        calibrate::to_double(mesh.positions[t[2]]))) /
              6;
  }
  std::vector<std::uint64_t> turned;
  for (const std::uint64_t e : edges) turned.push_back(edge(e & 0xFFFFFFFFU, e >> 32U));
  std::ranges::sort(edges);
  std::ranges::sort(turned);
  const bool single = std::ranges::adjacent_find(edges) == edges.end();
  return single && edges == turned ? volume : 0;
}

void expect_view_and_light(const PaperScene& scene) {
  EXPECT_GT(scene.horizontal_view_rad, 0.1);
  EXPECT_LT(scene.horizontal_view_rad, 2);
  EXPECT_EQ(scene.environment.smoothed.size(), 6U);
  EXPECT_GT(mean(irradiance_of(scene.environment, {0, 0, 1})), 0.01F);
  // Something stands in the middle of the picture.
  const Scene compiled(scene.scene);
  const Vec3 eye = calibrate::position_of(scene.cam_from_set);
  const Vec3 forward = scene.cam_from_set.R.transposed() * Vec3{0, 0, 1};
  EXPECT_TRUE(closest_hit(compiled, calibrate::to_float(eye), calibrate::to_float(forward), 0,
                          mask_virtual, RayKind::camera));
}

TEST(PaperFigures, TellTheVideosThatPomisTableHas) {
  for (const PaperFigure& figure : paper_figures()) {
    const bool has_video = figure.scene != "headlight";
    EXPECT_EQ(figure.video_width > 0, has_video) << figure.scene;
    EXPECT_EQ(figure.video_height > 0, has_video) << figure.scene;
    EXPECT_EQ(figure.video_fps, !has_video ? 0 : figure.scene == "car" ? 1 : 25) << figure.scene;
  }
}

class PaperScenes : public testing::TestWithParam<std::string_view> {
 protected:
  const PaperScene& scene() const { return made(std::string(GetParam())); }
};

TEST_P(PaperScenes, HasThePapersTrianglesAllSoundAndAViewOfThem) {
  const auto figure = std::ranges::find(paper_figures(), GetParam(), &PaperFigure::scene);
  ASSERT_NE(figure, paper_figures().end());
  const SceneDescription& description = scene().scene;
  EXPECT_EQ(triangle_count(description), figure->triangles);
  EXPECT_EQ(description.background, "environment");
  for (const Instance& instance : description.instances) {
    const Mesh& mesh = *description.meshes.at(instance.mesh);
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size()) << instance.name;
    ASSERT_TRUE(mesh.uvs.empty() || mesh.uvs.size() == mesh.positions.size()) << instance.name;
    for (const Vec3f n : mesh.normals) ASSERT_NEAR(length(n), 1, 1e-4) << instance.name;
    std::size_t turned = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (const auto corner : mesh.triangles[t]) ASSERT_LT(corner, mesh.positions.size());
      const auto c = corners_of(description, instance, t);
      const double area = length(cross(calibrate::to_double(c[1]) - calibrate::to_double(c[0]),
                                       calibrate::to_double(c[2]) - calibrate::to_double(c[0])));
      ASSERT_TRUE(std::isfinite(area) && area > 0) << instance.name << " " << t;
      const auto& [i, j, k] = mesh.triangles[t];
      const Vec3f winding =
          cross(mesh.positions[j] - mesh.positions[i], mesh.positions[k] - mesh.positions[i]);
      turned += dot(winding, mesh.normals[i] + mesh.normals[j] + mesh.normals[k]) > 0 ? 0 : 1;
    }
    EXPECT_EQ(GetParam() == "car" ? 0 : turned, 0U) << instance.name;
  }
  expect_view_and_light(scene());
}

// Of those whose triangles are not also in another, or tested elsewhere (MadeCar).
class OwnPaperScenes : public PaperScenes {};

TEST_P(OwnPaperScenes, IsTheSameEveryTime) {
  const PaperScene again = made_paper_scene(GetParam());
  EXPECT_EQ(serialize(again.scene), serialize(scene().scene));
  EXPECT_EQ(again.environment.radiance.pixels, scene().environment.radiance.pixels);
  EXPECT_EQ(again.lamps, scene().lamps);
  EXPECT_EQ(again.cam_from_set, scene().cam_from_set);
}

// Whether any of the lines leads as far as an eye, from the front of the triangle's middle or near
// its corners.
bool is_seen(const Scene& scene,
             const std::array<Vec3f, 3>& c,
             float eye_m,
             const std::vector<Vec3f>& directions) {
  const Vec3f normal = normalize(cross(c[1] - c[0], c[2] - c[0]));
  const Vec3f middle = (c[0] + c[1] + c[2]) * (1.0F / 3);
  const float size = std::max({std::abs(middle.x), std::abs(middle.y), std::abs(middle.z)});
  for (const Vec3f towards : {middle, c[0], c[1], c[2]}) {
    const Vec3f point = middle + (towards - middle) * 0.85F;
    for (const Vec3f direction : directions) {
      if (dot(direction, normal) <= 0) continue;
      const Vec3f origin = point + normal * (size * 1e-5F);
      if (transmittance(scene, origin, direction, 0, eye_m, mask_virtual) != Vec3f{}) return true;
    }
  }
  return false;
}

std::vector<Vec3f> make_directions(int count) {
  std::vector<Vec3f> directions;
  for (int i = 0; i < count; ++i) {
    const float z = 1 - (2 * static_cast<float>(i) + 1) / static_cast<float>(count);
    const float azimuth = static_cast<float>(i) * 2.39996323F;
    const float r = std::sqrt(1 - z * z);
    directions.push_back({r * std::cos(azimuth), r * std::sin(azimuth), z});
  }
  return directions;
}

TEST_P(OwnPaperScenes, HidesHardlyATriangle) {
  const SceneDescription& description = scene().scene;
  // A bulb's parts also count as seen if they are once it is drawn out of its housing.
  SceneDescription drawn_out = description;
  for (Instance& instance : drawn_out.instances)
    if (instance.name.starts_with("bulb")) instance.set_from_object[3] += 0.5F;
  const Scene compiled(description), drawn(drawn_out);
  EXPECT_EQ(compiled.skipped_triangles(), 0U);
  const std::vector<Vec3f> few = make_directions(100), many = make_directions(3000);
  // In a room the eye may be inside; out of all else a line must lead.
  const float eye_m = GetParam() == "tv_room" ? 1.0F : ray_far;
  // Of many triangles, every so many-th.
  const std::size_t step = triangle_count(description) > 50000 ? 97 : 1;
  std::size_t hidden = 0, tested = 0;
  for (std::size_t n = 0; n < description.instances.size(); ++n) {
    const Instance& instance = description.instances[n];
    std::vector<std::uint8_t> seen(description.meshes[instance.mesh]->triangles.size() / step);
    capture::parallel_for(std::size_t{0}, seen.size(), [&](std::size_t i) {
      prepare_thread();
      const auto corners = corners_of(description, instance, i * step);
      const auto outside = corners_of(drawn_out, drawn_out.instances[n], i * step);
      seen[i] = is_seen(compiled, corners, eye_m, few) || is_seen(drawn, outside, eye_m, few) ||
                        is_seen(compiled, corners, eye_m, many) ||
                        is_seen(drawn, outside, eye_m, many)
                    ? 1
                    : 0;
    });
    const auto unseen = static_cast<std::size_t>(std::ranges::count(seen, 0));
    tested += seen.size(), hidden += unseen;
    if (unseen > 0) RecordProperty(instance.name, static_cast<int>(unseen));
  }
  RecordProperty("hidden", static_cast<int>(hidden));
  EXPECT_LT(hidden * 100, tested);
}

std::string name_of(const testing::TestParamInfo<std::string_view>& info) {
  return std::string(info.param);
}

INSTANTIATE_TEST_SUITE_P(EachOf, PaperScenes, testing::ValuesIn(paper_scene_names()), name_of);
INSTANTIATE_TEST_SUITE_P(EachOf,
                         OwnPaperScenes,
                         testing::Values("tv_room", "glass_sphere", "headlight"),
                         name_of);

TEST(MadePaperScene, RefusesANameOfNone) {
  EXPECT_THAT([] { made_paper_scene("teapot"); },
              testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("glass_sphere")));
}

// The corners of a picture: texture coordinates 0..1, upright in the set.
void expect_upright_picture(const SceneDescription& scene, const std::string& name, Vec3f facing) {
  const Instance& instance = part(scene, name);
  const Mesh& mesh = *scene.meshes[instance.mesh];
  EXPECT_EQ(mesh.triangles.size(), 2U);
  const Vec3f right = normalize(cross(facing, Vec3f{0, 0, -1}));
  Vec3f corner[2][2];
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const auto& [u, v] = mesh.uvs[i];
    ASSERT_TRUE((u == 0 || u == 1) && (v == 0 || v == 1));
    corner[u == 1][v == 1] = in_set(instance, mesh.positions[i]);
    EXPECT_GT(dot(mesh.normals[i], facing), 0.9F);
  }
  for (const std::size_t v : {0U, 1U}) EXPECT_GT(dot(corner[1][v] - corner[0][v], right), 0.3F);
  for (const std::size_t u : {0U, 1U}) EXPECT_GT(corner[u][0].z - corner[u][1].z, 0.3F);
}

TEST(MadeTvRoom, ShowsAnUprightPictureThatGlows) {
  const SceneDescription room = make_tv_room();
  expect_upright_picture(room, "tv", {0, -1, 0});
  const Material& screen = room.materials[mesh_of(room, "tv").materials[0]];
  EXPECT_EQ(screen.name, "screen");
  const auto users = std::ranges::count_if(room.instances, [&](const Instance& instance) {
    return room.meshes[instance.mesh]->materials[0] == mesh_of(room, "tv").materials[0];
  });
  EXPECT_EQ(users, 1);
  const StandardParameters p = standard_parameters(screen, room.textures.size());
  EXPECT_EQ(p.emission[0], 1);
  EXPECT_EQ(p.base_color[0], 0);
  EXPECT_GE(p.emission_texture, 0);
  const auto& positions = mesh_of(room, "tv").positions;
  EXPECT_NEAR(length((positions[0] + positions[2]) * 0.5F - tv_screen_middle), 0, 1e-6);
  for (const char* name : {"floor", "carpet", "table", "table legs", "sofa", "shelf", "vase"})
    EXPECT_NO_THROW(part(room, name)) << name;
}

TEST(MadeTvRoom, IsLitByTheScreenOrByALamp) {
  EXPECT_EQ(made("tv_room").lit_by, "");
  EXPECT_EQ(made("tv_room").lamps.size(), 1U);
  EXPECT_EQ(made("tv_room_lit").lit_by, "tv");
  EXPECT_TRUE(made("tv_room_lit").lamps.empty());
}

TEST(MadeStage, HasPersonsThatStandOnTheFloor) {
  const SceneDescription stage = make_stage();
  for (const char* name : {"person_1", "person_2"}) {
    expect_upright_picture(stage, name, {0, -1, 0});
    float lowest = 9;
    for (const Vec3f p : mesh_of(stage, name).positions) lowest = std::min(lowest, p.z);
    EXPECT_EQ(lowest, 0);
    const Material& material = stage.materials[mesh_of(stage, name).materials[0]];
    EXPECT_EQ(material.name, name);
    const StandardParameters p = standard_parameters(material, stage.textures.size());
    EXPECT_GT(p.alpha_cutoff, 0);
    const Texture& texture = *stage.textures[static_cast<std::size_t>(p.base_color_texture)];
    EXPECT_EQ(texture.channels, 4);
    // A person stands within: the corners are empty, the middle is not, the edge is soft.
    const auto row = static_cast<std::size_t>(texture.width) * 4;
    EXPECT_EQ(texture.texels[3], 0);
    EXPECT_EQ(texture.texels[row * static_cast<std::size_t>(texture.height / 2) + row / 2 + 3],
              255);
    std::size_t soft = 0, full = 0;
    for (std::size_t i = 3; i < row * static_cast<std::size_t>(texture.height); i += 4) {
      soft += texture.texels[i] > 0 && texture.texels[i] < 255 ? 1 : 0;
      full += texture.texels[i] == 255 ? 1 : 0;
    }
    EXPECT_GT(full, row / 4 * static_cast<std::size_t>(texture.height) / 8);
    EXPECT_GT(soft, static_cast<std::size_t>(texture.height));
    EXPECT_LT(soft, full / 5);
  }
}

TEST(MakeGlassSphere, IsAClosedBodyWithTheNormalsOfASphere) {
  const SceneDescription scene = make_glass_sphere();
  const Mesh& sphere = mesh_of(scene, "glass sphere");
  EXPECT_EQ(sphere.triangles.size(), glass_sphere_triangles);
  EXPECT_EQ(scene.materials[sphere.materials[0]].shader, "glass");
  for (std::size_t i = 0; i < sphere.positions.size(); ++i) {
    const Vec3f out = sphere.positions[i] - glass_sphere_middle;
    EXPECT_NEAR(length(out), glass_sphere_radius_m, 1e-6);
    EXPECT_NEAR(length(sphere.normals[i] - normalize(out)), 0, 1e-6);
  }
  const double r = glass_sphere_radius_m;
  const double whole = 4.0 / 3 * std::numbers::pi * r * r * r;
  const double volume = closed_volume(sphere);
  EXPECT_LT(volume, whole);
  EXPECT_GT(volume, 0.93 * whole);
}

TEST(MakeHeadlight, HasClosedBodiesOfGlassOfRealSizeWhoseNormalsLeaveTheGlass) {
  const SceneDescription scene = make_headlight();
  Vec3f lower{9, 9, 9}, upper{-9, -9, -9};
  for (const Vec3f p : mesh_of(scene, "cover").positions) {
    lower = {std::min(lower.x, p.x), std::min(lower.y, p.y), std::min(lower.z, p.z)};
    upper = {std::max(upper.x, p.x), std::max(upper.y, p.y), std::max(upper.z, p.z)};
  }
  EXPECT_NEAR(upper.y - lower.y, 0.25, 0.001);
  EXPECT_NEAR(upper.z - lower.z, 0.16, 0.001);
  std::vector<std::string> glass;
  for (const Instance& instance : scene.instances) {
    const Mesh& mesh = *scene.meshes[instance.mesh];
    if (scene.materials[mesh.materials[0]].shader == "glass") glass.push_back(instance.name);
  }
  EXPECT_THAT(glass, testing::UnorderedElementsAre("cover", "bulb envelope", "bulb capsule"));
  // Area times thickness: a shell whose cavity were turned the other way would have more.
  const double cover = closed_volume(mesh_of(scene, "cover"));
  EXPECT_GT(cover, 0.003 * 0.026);
  EXPECT_LT(cover, 0.0045 * 0.030);
  const auto tube = [](double radius, double length) {
    return std::numbers::pi * radius * radius * (length - 2 * radius / 3);
  };
  const double envelope = tube(0.009, 0.0515) - tube(0.0081, 0.0497);
  EXPECT_NEAR(closed_volume(mesh_of(scene, "bulb envelope")), envelope, 0.02 * envelope);
  const double capsule = tube(0.0056, 0.027) - tube(0.0048, 0.0254);
  EXPECT_NEAR(closed_volume(mesh_of(scene, "bulb capsule")), capsule, 0.02 * capsule);
}

TEST(MakeHeadlight, KeepsItsBulbsBodiesApart) {
  // In the bulb's frame: each within the cavity of the next, but for wires, which pass the glass.
  const SceneDescription scene = make_headlight();
  const auto reach = [&](const char* name) {
    std::array<float, 3> r{0, 9, -9};  // from the axis, down, up
    for (const Vec3f p : mesh_of(scene, name).positions)
      r = {std::max(r[0], std::hypot(p.x, p.y)), std::min(r[1], p.z), std::max(r[2], p.z)};
    return r;
  };
  const auto filament = reach("bulb filament"), capsule = reach("bulb capsule");
  EXPECT_LT(filament[0], 0.0048F);
  EXPECT_LT(capsule[0], 0.0081F);
  EXPECT_GT(capsule[1], -0.0246F);
  EXPECT_LT(capsule[2], 0.0251F);
  EXPECT_GT(filament[1], capsule[1] + 0.0008F);
  EXPECT_LT(filament[2], capsule[2] - 0.0008F);
}

TEST(MakeHeadlight, HasABulbThatMovesAsOneAndSitsInTheFocus) {
  const SceneDescription scene = make_headlight();
  std::size_t parts = 0;
  for (const Instance& instance : scene.instances) {
    if (!instance.name.starts_with("bulb")) continue;
    ++parts;
    EXPECT_EQ(in_set(instance, {}), headlight_focus);
    // Its tip looks ahead.
    EXPECT_EQ(in_set(instance, {0, 0, 1}) - in_set(instance, {}), (Vec3f{1, 0, 0}));
  }
  EXPECT_EQ(parts, 5U);
  // Light from the focus leaves the reflector along the axis, but for the facets' spread.
  const Mesh& reflector = mesh_of(scene, "reflector");
  double along = 0;
  for (std::size_t i = 0; i < reflector.positions.size(); ++i) {
    const Vec3f from = normalize(reflector.positions[i] - headlight_focus);
    const Vec3f n = reflector.normals[i];
    along += (from - n * (2 * dot(from, n))).x / static_cast<double>(reflector.positions.size());
  }
  EXPECT_GT(along, 0.97);
  EXPECT_LT(along, 1);
}

}  // namespace
}  // namespace render::paper_scenes_test
