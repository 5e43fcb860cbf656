// Scenes of sets.
#include "studio/set_scene.h"

#include <cmath>
#include <filesystem>
#include <map>
#include <ranges>
#include <set>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>

#include "compositing/stand_in.h"
#include "render/join_scenes.h"
#include "render/load_mesh.h"
#include "render/load_shape.h"
#include "render/made_car.h"
#include "render/made_headlight.h"
#include "render/made_lamp.h"
#include "render/made_stage.h"
#include "render/made_tv_room.h"
#include "render/standard.h"

namespace studio {
namespace {

using render::Instance;
using render::Mesh;
using render::SceneDescription;

using render::Placement;
using render::product;

// Adds a model's meshes, textures and materials to the scene, and returns its instances, whose
// meshes are the scene's.
std::vector<Instance> add_model(SceneDescription& scene, const SceneDescription& model) {
  const auto first = static_cast<std::ptrdiff_t>(scene.instances.size());
  render::join(scene, model);
  std::vector<Instance> parts(scene.instances.begin() + first, scene.instances.end());
  scene.instances.erase(scene.instances.begin() + first, scene.instances.end());
  return parts;
}

SceneDescription scene_of(render::LoadedModel model,
                          const std::string& file,
                          std::vector<std::string>& notes) {
  for (const std::string& note : model.report.notes) notes.push_back(file + ": " + note);
  return std::move(model.scene);
}

SceneDescription load_file(const ObjectSettings& object,
                           std::vector<std::string>& notes,
                           const std::stop_token& stop) {
  const render::LoadOptions options = load_options(object);
  return scene_of(object.shapes ? render::load_deforming_model(object.mesh, options, stop)
                                : render::load_model(object.mesh, options, stop),
                  object.mesh, notes);
}

// Only the parts whose names `wanted` knows.
template <class Wanted>
SceneDescription parts_of(SceneDescription scene, const Wanted& wanted) {
  std::erase_if(scene.instances, [&](const Instance& part) { return !wanted(part.name); });
  return scene;
}

// All but the parts of these names. Throws std::invalid_argument for a name that no part has.
SceneDescription without(SceneDescription scene, const std::vector<std::string>& hidden) {
  for (const std::string& name : hidden) {
    if (std::ranges::find(scene.instances, name, &Instance::name) != scene.instances.end())
      continue;
    std::set<std::string> names;
    for (const Instance& part : scene.instances) names.insert(part.name);
    names.erase("");
    std::string list;
    for (const std::string& known : names) list += (list.empty() ? "" : ", ") + known;
    throw std::invalid_argument(fmt::format("cannot hide '{}': its parts are {}", name, list));
  }
  return parts_of(std::move(scene), [&](const std::string& name) {
    return std::ranges::find(hidden, name) == hidden.end();
  });
}

// A made thing by its name in the set, as it is.
SceneDescription make_thing(const std::string& made) {
  const auto one_of = [](std::initializer_list<std::string_view> names) {
    return [names = std::vector<std::string_view>(names)](const std::string& name) {
      return std::ranges::find(names, name) != names.end();
    };
  };
  if (made == "headlight") return render::make_headlight();
  if (made == "glass_sphere") return render::make_glass_sphere();
  if (made == "stage") {
    return parts_of(render::make_stage(),
                    [](const std::string& name) { return !name.starts_with("person_"); });
  }
  if (made == "tv_room") return render::make_tv_room(false);
  if (made == "tv") {
    return parts_of(render::make_tv_room(false),
                    one_of({"tv", "tv set", "tv foot", "tv light", "lowboard", "doors", "knobs",
                            "lowboard feet"}));
  }
  return parts_of(render::make_tv_room(false), one_of({"table", "table legs"}));  // "desk"
}

SceneDescription load_object(const ObjectSettings& object,
                             std::vector<std::string>& notes,
                             const std::stop_token& stop) {
  if (object.made.empty()) return load_file(object, notes, stop);
  if (object.made == "car") {
    render::MadeCarSettings car;
    car.head_lamp_gain = car.tail_lamp_gain = static_cast<float>(object.emission_gain);
    return without(render::made_car(car), object.hide);
  }
  if (object.made == "lamp") {
    return without(render::made_lamp(static_cast<float>(object.emission_gain)), object.hide);
  }
  SceneDescription thing = without(make_thing(object.made), object.hide);
  for (render::Material& material : thing.materials) {
    if (material.shader != "standard") continue;
    render::StandardParameters p = standard_parameters(material, thing.textures.size());
    p.emission_gain *= static_cast<float>(object.emission_gain);
    material = make_standard_material(material.name, p);
  }
  return thing;
}

// What people call it, or else its kind and number.
std::string name_of(const StandInSettings& stand_in, std::size_t number) {
  return stand_in.name.empty() ? fmt::format("stand-in {}", number) : stand_in.name;
}

// How far below its face a stand-in lies: more than rays are moved off a surface anywhere on
// it, up to 500 m from the origin, and a millimetre at most. So glass that stands on a floor ends
// before the floor begins, for every ray. Where both were one plane, rays would meet the one or the
// other by chance.
double gap_m(const StandInSettings& stand_in) {
  constexpr double most_m = 1e-3, of_coordinates = 2.5e-5;  // see render::offset_origin
  const calibrate::Vec3 at = stand_in.pose.position;
  const double reach =
      stand_in.pose.scale * std::hypot(stand_in.size.x / 2, stand_in.size.y / 2, stand_in.size.z);
  const double farthest = std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)}) + reach;
  return std::min(most_m, of_coordinates * farthest) / stand_in.pose.scale;
}

// Of a plane of z = 0.
Mesh plane_mesh(double width_m, double depth_m, double gap_m, std::uint32_t material) {
  const auto x = static_cast<float>(width_m / 2);
  const auto y = static_cast<float>(depth_m / 2);
  const auto z = static_cast<float>(-gap_m);
  Mesh mesh;
  mesh.positions = {{-x, -y, z}, {x, -y, z}, {x, y, z}, {-x, y, z}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  mesh.materials = {material};
  return mesh;
}

// Corner i has x from bit 0, y from bit 1, z from bit 2; the box stands on z = 0.
Mesh box_mesh(calibrate::Vec3 size, double gap_m, std::uint32_t material) {
  const auto within = [&](double whole) { return std::max(whole - 2 * gap_m, whole / 2); };
  const double top = std::max(size.z - gap_m, size.z / 2);
  Mesh mesh;
  for (unsigned i = 0; i < 8; ++i) {
    mesh.positions.push_back(
        calibrate::to_float({(i & 1U ? 0.5 : -0.5) * within(size.x),
                             (i & 2U ? 0.5 : -0.5) * within(size.y), i & 4U ? top : 0.0}));
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  mesh.materials = {material};
  return mesh;
}

render::Material stand_in_material(const StandInSettings& stand_in, const std::string& name) {
  render::StandInParameters p;
  for (std::size_t c = 0; c < 3; ++c) p.albedo[c] = stand_in.albedo[c];
  p.reflectance = stand_in.reflectance;
  p.roughness = stand_in.roughness;
  p.catches_shadow = stand_in.catches_shadow ? 1 : 0;
  p.catches_reflection = stand_in.catches_reflection ? 1 : 0;
  p.catches_light = stand_in.catches_light ? 1 : 0;
  return compositing::make_stand_in_material(name, p);
}

void add_stand_in(SceneDescription& scene,
                  const StandInSettings& stand_in,
                  std::size_t number,
                  std::vector<std::string>& notes,
                  const std::stop_token& stop) {
  const std::string name = name_of(stand_in, number);
  const auto material = static_cast<std::uint32_t>(scene.materials.size());
  std::vector<Instance> parts;
  if (stand_in.shape == StandInSettings::Shape::mesh) {
    // Its own materials do not matter: the plate shows what it looks like.
    SceneDescription model =
        scene_of(render::load_model(stand_in.mesh, {}, stop), stand_in.mesh, notes);
    for (const auto& mesh : model.meshes) {
      Mesh bare = *mesh;
      bare.materials = {material};
      bare.uvs.clear();
      bare.second_uvs.clear();
      bare.tangents.clear();
      bare.colours.clear();
      scene.meshes.push_back(std::make_shared<Mesh>(std::move(bare)));
    }
    const auto first = static_cast<std::uint32_t>(scene.meshes.size() - model.meshes.size());
    for (Instance& instance : model.instances) instance.mesh += first;
    parts = std::move(model.instances);
  } else {
    const bool box = stand_in.shape == StandInSettings::Shape::box;
    const double gap = gap_m(stand_in);
    scene.meshes.push_back(
        std::make_shared<Mesh>(box ? box_mesh(stand_in.size, gap, material)
                                   : plane_mesh(stand_in.size.x, stand_in.size.y, gap, material)));
    Instance part;
    part.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
    parts.push_back(part);
  }
  scene.materials.push_back(stand_in_material(stand_in, name));
  const Placement set_from_stand_in = matrix_of(stand_in.pose);
  for (Instance& part : parts) {
    part.name = name;
    part.kind = render::ObjectKind::stand_in;
    part.blocks_light = stand_in.blocks_light;
    part.occludes = stand_in.occludes;
    part.mirrored = stand_in.mirrored;
    part.set_from_object = product(set_from_stand_in, part.set_from_object);
    scene.instances.push_back(std::move(part));
  }
}

// Says which files of its shapes are not there, without reading any.
void note_missing_shapes(const ObjectSettings& object,
                         const std::string& name,
                         std::vector<std::string>& notes) {
  if (!object.shapes) return;
  std::string first;
  std::size_t count = 0;
  for (const std::string& file : object.shapes->files) {
    std::error_code error;
    if (std::filesystem::exists(file, error)) continue;
    if (count++ == 0) first = file;
  }
  if (count == 0) return;
  notes.push_back(
      fmt::format("object {}: {} of its {} shapes {} not there, the first of them {}: "
                  "the shape that it has by then stays",
                  name, count, object.shapes->files.size(), count == 1 ? "is" : "are", first));
}

// The report on the first file, with notes on each other that gives no shape.
render::LoadReport check_shapes(const ObjectSettings& object) {
  const render::LoadOptions options = load_options(object);
  const render::LoadedModel model = render::load_deforming_model(object.mesh, options);
  std::vector<render::DeformingPart> parts;
  for (const Instance& instance : model.scene.instances) {
    parts.push_back({instance.name, model.scene.meshes[instance.mesh]});
  }
  render::LoadReport report = model.report;
  report.notes.push_back(fmt::format("{} shapes", object.shapes->files.size()));
  for (const std::string& file : object.shapes->files | std::views::drop(1)) {
    try {
      render::load_shape(file, options, parts);
    } catch (const std::exception& error) {
      report.notes.push_back(fmt::format("{}: the shape that it has by then stays", error.what()));
    }
  }
  return report;
}

bool same_model(const ObjectSettings& a, const ObjectSettings& b) {
  return a.mesh == b.mesh && a.made == b.made && a.shapes == b.shapes && a.hide == b.hide &&
         a.emission_gain == b.emission_gain;
}

// Where a part stands in the set.
Placement set_from_part(const ObjectSettings& object, const ObjectPart& part) {
  // Steps are metres of the set, so the object's scale does not count.
  const double scale = object.pose.scale;
  const Placement step{1, 0, 0, static_cast<float>(part.copy[0] * object.spacing_m[0] / scale),
                       0, 1, 0, static_cast<float>(part.copy[1] * object.spacing_m[1] / scale),
                       0, 0, 1, 0};
  const Placement set_from_copy = product(matrix_of(object.pose), step);
  return product(product(set_from_copy, matrix_of(part.moved)), part.object_from_part);
}

void place_copies(SetScene& scene,
                  const ObjectSettings& object,
                  std::size_t index,
                  const std::string& name,
                  const std::vector<Instance>& model) {
  for (int row = 0; row < object.copies[1]; ++row) {
    for (int column = 0; column < object.copies[0]; ++column) {
      for (std::size_t number = 0; number < model.size(); ++number) {
        Instance instance = model[number];
        const ObjectPart& part = scene.parts.emplace_back(
            ObjectPart{index, {column, row}, instance.name, number, instance.set_from_object});
        instance.name = fmt::format("{}/{}", name, part.name);
        instance.set_from_object = set_from_part(object, part);
        scene.description.instances.push_back(std::move(instance));
      }
    }
  }
}

}  // namespace

std::optional<NamedParts> parts_named(const Set& set, std::string_view name) {
  const auto index_of = [&](std::string_view wanted) -> std::optional<std::size_t> {
    const auto found = std::ranges::find(set.objects, wanted, &ObjectSettings::name);
    if (wanted.empty() || found == set.objects.end()) return std::nullopt;
    return static_cast<std::size_t>(found - set.objects.begin());
  };
  if (const auto whole = index_of(name)) return NamedParts{*whole};
  const std::size_t slash = name.find('/');
  if (slash == std::string_view::npos) return std::nullopt;
  const auto object = index_of(name.substr(0, slash));
  if (!object) return std::nullopt;
  return NamedParts{*object, std::string(name.substr(slash + 1))};
}

render::LoadOptions load_options(const ObjectSettings& object) {
  render::LoadOptions options;
  options.hide = object.hide;
  options.emission_gain = static_cast<float>(object.emission_gain);
  return options;
}

std::array<float, 12> matrix_of(const PlacementSettings& placement) {
  const double cy = std::cos(placement.yaw_rad);
  const double sy = std::sin(placement.yaw_rad);
  const double ct = std::cos(placement.tilt_rad);
  const double st = std::sin(placement.tilt_rad);
  const double s = placement.scale;
  const std::array<double, 12> rows{s * cy, -s * sy * ct, s * sy * st,  placement.position.x,
                                    s * sy, s * cy * ct,  -s * cy * st, placement.position.y,
                                    0,      s * st,       s * ct,       placement.position.z};
  std::array<float, 12> result{};
  for (std::size_t i = 0; i < rows.size(); ++i) result[i] = static_cast<float>(rows[i]);
  return result;
}

std::string name_of(const ObjectSettings& object, std::size_t number) {
  return object.name.empty() ? fmt::format("object {}", number) : object.name;
}

SetScene describe_scene(const Set& set, const std::stop_token& stop) {
  SetScene result;
  SceneDescription& scene = result.description;
  scene.background = "plate";
  Faults faults(set.path);
  // A model that several objects show is held once, by the first of them.
  std::map<std::size_t, std::vector<Instance>> loaded;
  const auto stop_if_given_up = [&] {
    if (stop.stop_requested()) throw std::runtime_error("the scene is given up");
  };
  for (std::size_t i = 0; i < set.objects.size(); ++i) {
    stop_if_given_up();
    const ObjectSettings& object = set.objects[i];
    const std::string name = name_of(object, i + 1);
    try {
      auto found = std::ranges::find_if(
          loaded, [&](const auto& one) { return same_model(set.objects[one.first], object); });
      if (found == loaded.end()) {
        found = loaded.emplace(i, add_model(scene, load_object(object, result.notes, stop))).first;
        note_missing_shapes(object, name, result.notes);
      }
      const std::size_t before = scene.instances.size();
      place_copies(result, object, i, name, found->second);
      if (const std::size_t all = scene.instances.size();
          all > static_cast<std::size_t>(most_instances)) {
        faults.add(object.place,
                   fmt::format("{}: {} instances of its parts, {} with the objects before, but a "
                               "set holds at most {}",
                               name, all - before, all, most_instances));
        break;
      }
    } catch (const std::runtime_error& error) {
      faults.add(object.place, error.what());
    } catch (const std::invalid_argument& error) {
      faults.add(object.place, error.what());
    }
  }
  for (std::size_t i = 0; i < set.stand_ins.size(); ++i) {
    stop_if_given_up();
    try {
      add_stand_in(scene, set.stand_ins[i], i + 1, result.notes, stop);
    } catch (const std::runtime_error& error) {
      faults.add(set.stand_ins[i].place, error.what());
    }
  }
  stop_if_given_up();
  if (const auto all = faults.sorted(); !all.empty()) throw SetError(all);
  show_videos(set, result, faults);
  add_persons(set, result, faults);
  if (const auto all = faults.sorted(); !all.empty()) throw SetError(all);
  if (scene.instances.size() > static_cast<std::size_t>(most_instances)) {
    faults.add({}, fmt::format("{} instances of parts, but a set holds at most {}",
                               scene.instances.size(), most_instances));
    throw SetError(faults.sorted());
  }
  if (!set.objects.empty() && !set.probe && set.lamps.empty() && set.videos.empty()) {
    result.notes.emplace_back(
        "nothing lights the objects: without [probe], [[lamp]] or [[video_light]] they are black, "
        "but for what glows by itself");
  }
  return result;
}

std::vector<ModelReport> check_models(const Set& set) {
  std::vector<ModelReport> reports;
  Faults faults(set.path);
  const auto check = [&](const std::string& name, const std::string& file, Place place,
                         const auto& load) {
    if (file.empty()) return;
    try {
      reports.push_back({name, file, load()});
    } catch (const std::runtime_error& error) {
      faults.add(place, error.what());
    } catch (const std::invalid_argument& error) {
      faults.add(place, error.what());
    }
  };
  for (std::size_t i = 0; i < set.objects.size(); ++i) {
    const ObjectSettings& object = set.objects[i];
    check(name_of(object, i + 1), object.mesh, object.place, [&] {
      return object.shapes ? check_shapes(object)
                           : render::load_model(object.mesh, load_options(object)).report;
    });
  }
  for (std::size_t i = 0; i < set.stand_ins.size(); ++i) {
    const StandInSettings& stand_in = set.stand_ins[i];
    check(name_of(stand_in, i + 1), stand_in.mesh, stand_in.place,
          [&] { return render::load_model(stand_in.mesh).report; });
  }
  if (const auto all = faults.sorted(); !all.empty()) throw SetError(all);
  return reports;
}

void place_object(const Set& set, std::size_t object, SetScene& scene) {
  for (std::size_t i = 0; i < scene.parts.size(); ++i) {
    if (scene.parts[i].object != object) continue;
    Instance& instance = scene.description.instances[i];
    instance.set_from_object = set_from_part(set.objects[object], scene.parts[i]);
    instance.moves = true;
  }
}

void require_part(const Set& set,
                  std::size_t object,
                  std::string_view part,
                  const SetScene& scene) {
  std::string names;
  for (const ObjectPart& candidate : scene.parts) {
    if (candidate.object != object) continue;
    if (candidate.name.starts_with(part)) return;
    if (candidate.copy == std::array{0, 0}) names += (names.empty() ? "" : ", ") + candidate.name;
  }
  throw std::invalid_argument(fmt::format("object \"{}\" has no part \"{}...\"; it has: {}",
                                          set.objects[object].name, part, names));
}

void move_parts(const Set& set,
                std::size_t object,
                std::string_view part,
                const PlacementSettings& by,
                SetScene& scene) {
  require_part(set, object, part, scene);
  for (std::size_t i = 0; i < scene.parts.size(); ++i) {
    ObjectPart& candidate = scene.parts[i];
    if (candidate.object != object || !candidate.name.starts_with(part)) continue;
    candidate.moved = by;
    Instance& instance = scene.description.instances[i];
    instance.set_from_object = set_from_part(set.objects[object], candidate);
    instance.moves = true;
  }
}

std::vector<render::LocalLight> describe_lamps(const Set& set) {
  std::vector<render::LocalLight> lamps;
  for (const LampSettings& lamp : set.lamps) {
    const auto& [red, green, blue] = lamp.intensity;
    lamps.push_back({calibrate::to_float(lamp.position),
                     calibrate::to_float(lamp.facing.value_or(calibrate::Vec3{})),
                     {red, green, blue}});
  }
  return lamps;
}

}  // namespace studio
