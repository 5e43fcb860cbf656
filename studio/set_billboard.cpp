// Set files: persons as billboards.
#include <numbers>

#include <fmt/format.h>

#include "compositing/billboard.h"
#include "studio/set_scene.h"
#include "studio/set_sections.h"

namespace studio {
namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr Range metres{-farthest_m, farthest_m};
constexpr Range share{0, 1};

KeyChoice read_key(Section table, const SetContext& context) {
  KeyChoice key;
  key.place = table.place_of("plate");
  std::string plate = "auto";
  table.text("plate", plate);
  if (plate != "auto") table.file("plate", context.base, key.plate);
  if (table.integers("footage", key.footage, 0, 1'000'000'000)) {
    if (!key.plate.empty()) table.fault("footage", "is for plate = \"auto\"");
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
  table.number("screen", settings.screen, {0, 0.9});
  table.number("core", settings.core, {0.1, 1});
  if (!(settings.screen < settings.core)) table.fault("core", "must be more than screen");
  table.number("edge", settings.edge, {-1, 1});
  table.number("despill", settings.despill, {0, 4});
  table.boolean("learned", settings.learned);
  table.boolean("follows_light", settings.follows_light);
  table.number("smoothing", settings.smoothing, {0, 10});
  table.file("garbage", context.base, key.garbage);
  table.finish();
  return key;
}

// Where the person stands, and how the picture is laid there.
void read_standing(Section& section, const SetContext& context, PersonSettings& person) {
  const bool has_lens = section.has("lens") || section.has("model");
  if (has_lens != section.has("pose")) {
    section.fault("", "lens and pose of the person's camera come together");
  }
  if (auto lens = read_lens_key(section, {0, 0}, context.base)) person.lens = *lens;
  if (auto table = section.table("pose")) person.cam_from_set = read_fixed_pose(*table);
  std::string feet;
  person.by_feet = section.word("feet", feet, {"auto"});
  section.number("floor", person.floor_z, metres);
  if (person.by_feet && !has_lens) {
    section.fault("feet", "needs lens and pose of the person's camera");
  }
  if (person.by_feet == section.has("position")) {
    section.fault("", "must have either feet = \"auto\" or position = [x, y, z]");
  }
  section.vector("position", person.position, metres);
  if (!has_lens) section.need("height", "of the whole picture in the set, in metres");
  if (has_lens && section.has("height")) {
    section.fault("height", "is told by the camera's lens and pose already");
  }
  section.number("height", person.height_m, {1e-3, 1e4});
  double yaw_deg = 0, turn_deg = 30;
  if (section.number("yaw", yaw_deg, {-3600, 3600}) && has_lens) {
    section.fault("yaw", "is told by the camera's pose already");
  }
  section.number("turn", turn_deg, {0, 74});
  person.yaw_rad = yaw_deg * degree;
  person.turn_rad = turn_deg * degree;
}

}  // namespace

PersonSettings read_billboard_section(Section section, const SetContext& context) {
  PersonSettings person;
  section.text("name", person.name);
  section.need("source", "the person's video: a file's path or a camera's URI");
  person.place = section.place_of("source");
  read_source_key(section, "source", context.base, person.source);
  section.boolean("loop", person.loop);
  section.integer("frame", person.first, std::int64_t{0}, std::int64_t{1} << 40);
  read_colour(section, person.colour);
  section.colour("gain", person.gain, {0, 1e9});
  section.boolean("lit", person.lit);
  read_standing(section, context, person);
  if (auto table = section.table("key")) person.key = read_key(*table, context);
  section.finish();
  return person;
}

void add_persons(const Set& set, SetScene& scene, Faults& faults) {
  render::SceneDescription& description = scene.description;
  scene.first_person = description.instances.size();
  for (std::size_t i = 0; i < set.persons.size(); ++i) {
    const PersonSettings& person = set.persons[i];
    const std::string name = person.name.empty() ? fmt::format("person {}", i + 1) : person.name;
    const compositing::BillboardSettings shown{static_cast<std::uint32_t>(i), person.gain,
                                               person.lit};
    const auto material = static_cast<std::uint32_t>(description.materials.size());
    try {
      description.materials.push_back(person.lens
                                          ? compositing::make_billboard_material(
                                                name, shown, {*person.lens, person.cam_from_set})
                                          : compositing::make_billboard_material(name, shown));
    } catch (const std::invalid_argument& error) {
      faults.add(person.place, error.what());
      continue;
    }
    description.meshes.push_back(
        std::make_shared<const render::Mesh>(compositing::make_billboard_mesh(material)));
    render::Instance& instance = description.instances.emplace_back();
    instance.name = name;
    instance.mesh = static_cast<std::uint32_t>(description.meshes.size() - 1);
    instance.moves = true;
  }
}

}  // namespace studio
