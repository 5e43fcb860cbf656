// Set files: objects, stand-ins, lamps.
#include <algorithm>

#include <fmt/format.h>

#include "calibrate/angles.h"
#include "capture/sequence.h"
#include "studio/set_sections.h"

namespace studio {
namespace {

using calibrate::degree;
constexpr Range metres{-farthest_m, farthest_m};
constexpr Range size_range{1e-6, farthest_m};
constexpr Range share{0, 1};

void read_copies(Section& section, ObjectSettings& object) {
  std::array<int, 2> copies{};
  if (section.integers("copies", copies, 1, most_instances)) {
    const std::int64_t instances = std::int64_t{copies[0]} * copies[1];
    if (instances > most_instances) {
      section.fault("copies", fmt::format("asks for {} instances, but a set holds at most {}",
                                          instances, most_instances));
    } else {
      object.copies = copies;
    }
    section.need("spacing", "metres between copies, along x and y");
  }
  section.of_use_only(section.has("copies"), "spacing", "copies");
  std::vector<double> spacing;
  if (section.numbers("spacing", spacing, {2}, metres)) {
    object.spacing_m = {spacing[0], spacing[1]};
  }
}

// `mesh` as a pattern of numbered files, and how their shapes are shown.
void read_shapes(Section& section, const std::string& pattern, ObjectSettings& object) {
  constexpr std::int64_t most_shapes = 100'000;
  ShapeSettings shapes;
  read_fps(section, shapes.fps);
  section.boolean("loop", shapes.loop);
  std::int64_t first = 0, last = 0;
  try {
    const auto files = capture::numbered_files(pattern);
    first = files.begin()->first;
    last = files.rbegin()->first;
    section.integer("first", first, first, last);
  } catch (const std::runtime_error& error) {
    section.value("first");
    section.fault("mesh", error.what());
    return;
  }
  if (last - first >= most_shapes) {
    section.fault("mesh", fmt::format("its files' numbers go from {} to {}, but an object has at "
                                      "most {} shapes: begin later by `first`",
                                      first, last, most_shapes));
    return;
  }
  for (std::int64_t number = first; number <= last; ++number) {
    shapes.files.push_back(capture::numbered_file(pattern, number));
  }
  object.mesh = shapes.files.front();
  object.shapes = std::move(shapes);
}

void read_mesh(Section& section, const SetContext& context, ObjectSettings& object) {
  std::string given;
  const bool told = section.text("mesh", given);
  if (told) {
    const std::string path = (context.base / given).lexically_normal().string();
    if (capture::is_sequence(path)) return read_shapes(section, path, object);
  }
  for (const char* key : {"fps", "loop", "first"}) {
    if (section.value(key) != nullptr) {
      section.fault(key, "is for a mesh of numbered files, such as mesh = \"flag_%04d.obj\"");
    }
  }
  if (told) section.file("mesh", context.base, object.mesh);
}

bool holds(const std::vector<std::string>& words, std::string_view word) {
  return std::ranges::find(words, word) != words.end();
}

}  // namespace

PlacementSettings read_placement(Section table, PlacementSettings placement) {
  table.vector("position", placement.position, metres);
  double angle_deg = 0;
  if (table.number("tilt", angle_deg, {-360, 360})) placement.tilt_rad = angle_deg * degree;
  if (table.number("yaw", angle_deg, {-3600, 3600})) placement.yaw_rad = angle_deg * degree;
  table.number("scale", placement.scale, size_range);
  table.finish();
  return placement;
}

ObjectSettings read_object_section(Section section, const SetContext& context) {
  ObjectSettings object;
  section.text("name", object.name);
  if (section.has("mesh") == section.has("made")) {
    section.fault("", "must have either mesh = \"FILE\" or made = \"car\"");
  }
  object.place = section.place_of(section.has("mesh") ? "mesh" : "made");
  read_mesh(section, context, object);
  section.word("made", object.made,
               {"car", "headlight", "lamp", "stage", "glass_sphere", "tv_room", "tv", "desk"});
  if (auto table = section.table("pose")) object.pose = read_placement(*table);
  section.texts("hide", object.hide);
  section.number("emission_gain", object.emission_gain, {0, 1e9});
  read_copies(section, object);
  section.finish();
  return object;
}

StandInSettings read_stand_in_section(Section section, const SetContext& context) {
  StandInSettings stand_in;
  section.text("name", stand_in.name);
  std::string shape = "plane";
  section.word("shape", shape, {"plane", "box", "mesh"});
  stand_in.place = section.place_of(section.has("mesh") ? "mesh" : "shape");
  std::vector<double> size;
  if (shape == "plane") {
    stand_in.shape = StandInSettings::Shape::plane;
    section.need("size", "[x, y] of the plane in metres");
    section.numbers("size", size, {2}, size_range);
  } else if (shape == "box") {
    stand_in.shape = StandInSettings::Shape::box;
    section.need("size", "[x, y, z] of the box in metres");
    section.numbers("size", size, {3}, size_range);
  } else {
    stand_in.shape = StandInSettings::Shape::mesh;
    section.need("mesh", "the file of the mesh");
    section.file("mesh", context.base, stand_in.mesh);
  }
  section.of_use_only(shape == "mesh", "mesh", "shape = \"mesh\"");
  section.of_use_only(shape != "mesh", "size", "planes and boxes: a mesh has its own size");
  if (size.size() >= 2) stand_in.size = {size[0], size[1], size.size() == 3 ? size[2] : 0};
  if (auto table = section.table("pose")) stand_in.pose = read_placement(*table);

  std::vector<std::string> catches{"shadow", "light"};
  section.words("catches", catches, {"shadow", "reflection", "light"});
  stand_in.catches_shadow = holds(catches, "shadow");
  stand_in.catches_reflection = holds(catches, "reflection");
  stand_in.catches_light = holds(catches, "light");
  section.colour("albedo", stand_in.albedo, share);
  section.number("reflectance", stand_in.reflectance, share);
  section.number("roughness", stand_in.roughness, share);
  section.boolean("blocks_light", stand_in.blocks_light);
  section.boolean("occludes", stand_in.occludes);
  section.boolean("mirrored", stand_in.mirrored);
  section.finish();
  return stand_in;
}

LampSettings read_lamp_section(Section section) {
  LampSettings lamp;
  section.need("position", "where the lamp is, in metres");
  section.need("intensity", "what it shines: a number, or one for each colour");
  section.vector("position", lamp.position, metres);
  calibrate::Vec3 facing;
  if (section.vector("facing", facing, {-1, 1})) {
    if (calibrate::length(facing) < 0.5)
      section.fault("facing", "must be about of length 1");
    else
      lamp.facing = calibrate::normalize(facing);
  }
  section.colour("intensity", lamp.intensity, {0, 1e9});
  section.finish();
  return lamp;
}

}  // namespace studio
