// Set files: persons.
#include <algorithm>
#include <numeric>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "calibrate/angles.h"
#include "compositing/billboard.h"
#include "compositing/hull_march.h"
#include "compositing/visual_hull.h"
#include "studio/set_scene.h"
#include "studio/set_sections.h"

namespace studio {
namespace {

using calibrate::degree;
constexpr Range metres{-farthest_m, farthest_m};
constexpr Range share{0, 1};

KeyChoice read_key(Section table, const SetContext& context) {
  KeyChoice key;
  key.place = table.place_of("plate");
  std::string plate = "auto";
  table.text("plate", plate);
  key.takes_plate = plate == "take";
  if (plate != "auto" && !key.takes_plate) table.file("plate", context.base, key.plate);
  table.integer("take", key.take, 0, 1'000'000'000);
  table.of_use_only(key.takes_plate, "take", "plate = \"take\"");
  if (table.integers("footage", key.footage, 0, 1'000'000'000)) {
    if (plate != "auto") table.fault("footage", "is for plate = \"auto\"");
    if (key.footage[1] < key.footage[0]) table.fault("footage", "ends before it begins");
  }
  std::string method = "screen";
  table.word("method", method, {"screen", "difference"});
  std::string by = "frame";
  table.word("by", by, {"frame", "texel"});
  key.by_texel = by == "texel";
  compositing::KeySettings& settings = key.settings;
  settings.method =
      method == "screen" ? compositing::KeyMethod::screen : compositing::KeyMethod::difference;
  if (table.has("screen_colour")) {
    std::string colour;
    table.word("screen_colour", colour, compositing::screen_colour_names);
    if (!colour.empty()) settings.screen_colour = compositing::screen_colour_from_name(colour);
  }
  table.of_use_only(method == "screen", "screen_colour", "method = \"screen\"");
  table.number("screen", settings.screen, {0, 0.9});
  table.number("core", settings.core, {0.1, 1});
  if (!(settings.screen < settings.core)) table.fault("core", "must be more than screen");
  table.number("edge", settings.edge, {-1, 1});
  table.number("despill", settings.despill, {0, 2});
  table.boolean("learned", settings.learned);
  table.boolean("follows_light", settings.follows_light);
  table.number("smoothing", settings.smoothing, {0, 4});
  std::string effort = "full";
  table.word("effort", effort, {"full", "quick"});
  settings.effort =
      effort == "quick" ? compositing::KeyEffort::quick : compositing::KeyEffort::full;
  table.file("garbage", context.base, key.masks.garbage);
  table.file("core_mask", context.base, key.masks.core);
  if (key.by_texel && !key.masks.empty()) {
    table.fault("by", "\"texel\" knows no masks: key by \"frame\"");
  }
  table.finish();
  return key;
}

void read_camera(Section& section, const SetContext& context, PersonCamera& camera) {
  section.need("source", "the person's video: a file's path or a camera's URI");
  camera.place = section.place_of("source");
  read_source_key(section, "source", context.base, camera.source);
  section.boolean("loop", camera.loop);
  read_start(section, camera.source, camera.first);
  read_colour(section, camera.colour);
  read_deinterlace(section, camera.source, camera.deinterlace);
  std::optional<RigCamera> of_rig;
  if (section.has("rig_camera")) {
    of_rig = read_rig_camera(section, context, camera.lens, camera.cam_from_set, camera.response);
    if (of_rig) camera.lens_file = of_rig->lens_file;
  } else {
    camera.lens = read_lens_key(section, {0, 0}, context.base, &camera.lens_file);
    if (auto table = section.table("pose")) camera.cam_from_set = read_fixed_pose(*table);
    read_response_key(section, context.base, camera.response);
  }
  read_rectangle(section, "crop", {0, 0}, camera.crop);
  if (camera.lens && camera.crop) crop_lens(section, *camera.crop, *camera.lens);
  read_offset(section, context, of_rig, camera.offset_s);
  if (auto table = section.table("key")) camera.key = read_key(*table, context);
}

bool has_lens(const Section& section) {
  return section.has("lens") || section.has("model") || section.has("rig_camera");
}
bool has_pose(const Section& section) { return section.has("pose") || section.has("rig_camera"); }

// Where the person stands, and how the picture is laid there.
void read_standing(Section& section, PersonSettings& person) {
  const bool calibrated = has_lens(section);
  if (calibrated != has_pose(section)) {
    section.fault("", "lens and pose of the person's camera come together");
  }
  std::string feet;
  person.by_feet = section.word("feet", feet, {"auto"});
  const auto& key = person.cameras.front().key;
  if (person.by_feet && key && key->by_texel) {
    section.fault("key", "by: feet = \"auto\" needs whole frames keyed: \"frame\"");
  }
  section.number("floor", person.floor_z, metres);
  if (person.by_feet && !calibrated) {
    section.fault("feet", "needs lens and pose of the person's camera");
  }
  if (person.by_feet == section.has("position")) {
    section.fault("", "must have either feet = \"auto\" or position = [x, y, z]");
  }
  section.vector("position", person.position, metres);
  if (!calibrated) section.need("height", "of the whole picture in the set, in metres");
  if (calibrated && section.has("height")) {
    section.fault("height", "is told by the camera's lens and pose already");
  }
  const PersonCamera& first = person.cameras.front();
  if (section.has("position") && first.lens &&
      !calibrate::project(*first.lens, first.cam_from_set * person.position)) {
    section.fault("position",
                  "is where the person's own camera does not see: behind it, or too far "
                  "to the side for its lens");
  }
  section.of_use_only(person.by_feet, "floor", "feet = \"auto\"");
  if (person.by_feet && first.lens && has_pose(section) &&
      calibrate::position_of(first.cam_from_set).z <= person.floor_z) {
    section.fault("floor", "is not below the person's own camera, which so sees no feet on it");
  }
  section.number("height", person.height_m, {1e-3, 1e4});
  double yaw_deg = 0, turn_deg = 30;
  if (section.number("yaw", yaw_deg, {-3600, 3600}) && calibrated) {
    section.fault("yaw", "is told by the camera's pose already");
  }
  section.number("turn", turn_deg, {0, 74});
  person.yaw_rad = yaw_deg * degree;
  person.turn_rad = turn_deg * degree;
}

// The person's further cameras, and what they are for.
void read_further_cameras(Section& section, const SetContext& context, PersonSettings& person) {
  if (section.has("camera") && !has_lens(section)) {
    section.fault("camera", "needs lens and pose of the person's first camera");
  }
  std::vector<Section> tables = section.tables("camera");
  for (Section& further : tables) {
    if (person.cameras.size() == compositing::most_hull_views) {
      further.fault("", fmt::format("is one too many: a person has at most {} cameras",
                                    compositing::most_hull_views));
      break;
    }
    if (!has_lens(further)) further.need("lens", "of this camera: a file, or a table");
    if (!has_pose(further)) further.need("pose", "where this camera is in the set");
    read_camera(further, context, person.cameras.emplace_back());
    further.finish();
  }
  std::string shape = "auto";
  section.word("shape", shape, {"auto", "billboard", "hull"});
  if (shape == "billboard") person.shape = compositing::PersonShape::billboard;
  if (shape == "hull") person.shape = compositing::PersonShape::hull;
  section.number("error", person.error_m, {1e-3, 10});
  if (!section.has("camera")) {
    if (shape == "hull") section.fault("shape", "needs further cameras: [[billboard.camera]]");
    if (section.has("error"))
      section.fault("error", "is for further cameras: [[billboard.camera]]");
    return;
  }
  if (person.shape == compositing::PersonShape::billboard) return;
  if (person.lit) section.fault("lit", "is for billboards: a hull is shown as it was filmed");
  if (person.translucency > 0) {
    section.fault("translucency", "is for billboards: a hull's shadow has no colour");
  }
  tables.insert(tables.begin(), section);
  for (std::size_t i = 0; i < person.cameras.size(); ++i) {
    if (!person.cameras[i].key || !person.cameras[i].key->by_texel) continue;
    tables[i].fault("key", "by: a hull needs whole frames keyed: \"frame\"");
  }
}

std::string name_of(const PersonSettings& person, std::size_t index) {
  return person.name.empty() ? fmt::format("person {}", index + 1) : person.name;
}

render::Material hull_material(const PersonSettings& person,
                               const std::string& name,
                               std::uint32_t first_picture,
                               std::span<const std::size_t> cameras) {
  std::vector<compositing::HullView> views;
  for (const std::size_t i : cameras) {
    const PersonCamera& camera = person.cameras[i];
    views.push_back({first_picture + static_cast<std::uint32_t>(i),
                     {camera.lens.value(), camera.cam_from_set}});
  }
  compositing::HullSettings settings;
  settings.gain = person.gain;
  return compositing::make_hull_material(name, settings, views);
}

}  // namespace

PersonSettings read_billboard_section(Section section, const SetContext& context) {
  PersonSettings person;
  section.text("name", person.name);
  read_camera(section, context, person.cameras.front());
  section.colour("gain", person.gain, {0, 1e9});
  section.boolean("lit", person.lit);
  section.number("translucency", person.translucency, share);
  if (person.lit && person.translucency > 0) {
    section.fault("translucency", "is not for what is lit: it would give more light than it gets");
  }
  read_standing(section, person);
  read_further_cameras(section, context, person);
  section.finish();
  return person;
}

void refuse_same_names(const std::vector<PersonSettings>& persons, Faults& faults) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < persons.size(); ++i) {
    const std::string name = name_of(persons[i], i);
    if (names.insert(name).second) continue;
    faults.add(persons[i].first().place, fmt::format("there are two persons named \"{}\"", name));
  }
}

void add_persons(const Set& set, SetScene& scene, Faults& faults) {
  render::SceneDescription& description = scene.description;
  const auto add = [&](const std::string& name, render::Material material, const auto& make_mesh) {
    const auto index = static_cast<std::uint32_t>(description.materials.size());
    description.materials.push_back(std::move(material));
    description.meshes.push_back(std::make_shared<const render::Mesh>(make_mesh(index)));
    render::Instance& instance = description.instances.emplace_back();
    instance.name = name;
    instance.mesh = static_cast<std::uint32_t>(description.meshes.size() - 1);
    instance.moves = true;
  };
  scene.first_person = description.instances.size();
  std::uint32_t picture = 0;
  for (std::size_t i = 0; i < set.persons.size(); ++i) {
    const PersonSettings& person = set.persons[i];
    const std::string name = name_of(person, i);
    const auto cameras = static_cast<std::uint32_t>(person.cameras.size());
    for (const PersonCamera& camera : person.cameras) {
      const compositing::BillboardSettings shown{picture++, person.gain, person.lit,
                                                 person.translucency};
      try {
        add(name,
            camera.lens ? compositing::make_billboard_material(name, shown,
                                                               {*camera.lens, camera.cam_from_set})
                        : compositing::make_billboard_material(name, shown),
            compositing::make_billboard_mesh);
      } catch (const std::invalid_argument& error) {
        faults.add(camera.place, error.what());
      }
    }
    if (!person.may_be_hull() || !faults.sorted().empty()) continue;
    std::vector<std::size_t> all(cameras);
    std::iota(all.begin(), all.end(), std::size_t{0});
    scene.hulls.push_back({i, description.materials.size(), picture, all});
    try {
      add(name, hull_material(person, name, picture, all), compositing::make_hull_mesh);
    } catch (const std::invalid_argument& error) {
      faults.add(person.first().place, error.what());
    }
    picture += cameras;
  }
}

void see_hull_by(const Set& set,
                 std::size_t person,
                 std::span<const std::size_t> cameras,
                 SetScene& scene) {
  const auto hull = std::ranges::find(scene.hulls, person, &PersonHull::person);
  if (hull == scene.hulls.end()) throw std::invalid_argument("the person has no hull");
  const PersonSettings& settings = set.persons.at(person);
  scene.description.materials[hull->material] =
      hull_material(settings, name_of(settings, person), hull->first_picture, cameras);
  hull->cameras.assign(cameras.begin(), cameras.end());
}

}  // namespace studio
