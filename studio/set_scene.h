// From a set's objects, stand-ins and lamps to what the kernel renders.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "render/area_light.h"
#include "render/load_mesh.h"
#include "render/scene.h"
#include "studio/set.h"

namespace studio {

// A part of one copy of an object: an instance of the scene.
struct ObjectPart {
  std::size_t object = 0;     // of the set
  std::array<int, 2> copy{};  // column and row
  std::string name;           // of its node in the model
  std::size_t number = 0;     // in the model
  std::array<float, 12> object_from_part{};
  PlacementSettings moved{{}, 0, 0, 1};  // in the object's frame, from where the model has it
};

// The hull of one of the set's persons: a material that looks at live pictures, one for each of the
// person's cameras.
struct PersonHull {
  std::size_t person = 0;
  std::size_t material = 0;
  std::uint32_t first_picture = 0;
  std::vector<std::size_t> cameras;  // of the person, that it is seen by now
};

// A set's scene, and what it takes to move things in it.
struct SetScene {
  render::SceneDescription description;
  std::vector<ObjectPart> parts;   // its first instances, in order
  std::size_t first_person = 0;    // first instance of the set's persons; see add_persons
  std::vector<PersonHull> hulls;   // of the persons that may be one
  std::vector<std::string> notes;  // what was not understood of its models, with their files
};

// What people call an object, or else its number, from 1.
std::string name_of(const ObjectSettings& object, std::size_t number);

// What "OBJECT" or "OBJECT/PART" names.
struct NamedParts {
  std::size_t object = 0;             // of the set
  std::optional<std::string> part{};  // what the names of its parts begin with; nothing = all of it
};
// An object whose name has a slash comes before a part. Nothing if the set has no such object.
std::optional<NamedParts> parts_named(const Set& set, std::string_view name);

// How its model's files are to be read.
render::LoadOptions load_options(const ObjectSettings& object);

// The scene of a set: first all objects, each part of each copy an instance named "OBJECT/PART",
// then the stand-ins. Camera rays that meet nothing see the plate. Throws SetError naming every
// mesh that cannot be loaded, with its place in the set file. Once a stop is requested, the model
// that is being read is given up, no further one is read, and it throws std::runtime_error.
SetScene describe_scene(const Set& set, const std::stop_token& stop = {});

// What was found in a model's file that the set names: by an object or a stand-in.
struct ModelReport {
  std::string name;  // of the object or stand-in
  std::string file;
  render::LoadReport report;
};

// Loads every model file of the set, one after the other, and keeps none. Of an object that deforms
// all shapes are read, and the report of its first one notes what is wrong with others. Throws
// SetError naming every one that cannot be loaded, with its place in the set file.
std::vector<ModelReport> check_models(const Set& set);

// Puts an object's parts to where the set says that the object is, and tells that they move. Loads
// nothing.
void place_object(const Set& set, std::size_t object, SetScene& scene);

// Throws std::invalid_argument, listing the object's parts, if the name of none begins with `part`.
void require_part(const Set& set, std::size_t object, std::string_view part, const SetScene& scene);

// Moves the parts of an object whose names begin with `part` from where the model has them. Throws
// as require_part.
void move_parts(const Set& set,
                std::size_t object,
                std::string_view part,
                const PlacementSettings& by,
                SetScene& scene);

// Rows of the 3x4 matrix set_from_object of a placement.
std::array<float, 12> matrix_of(const PlacementSettings& placement);

// Lets the set's videos be shown where it says, and names them in the scene, in the set's order.
// What describe_scene ends with; adds a fault for each that is shown nowhere.
void show_videos(const Set& set, SetScene& scene, Faults& faults);

// Adds the set's persons in its order, and places them nowhere yet. Each is a billboard for each of
// its cameras, and, if it may be one, a hull: as many instances. Live pictures go as they do: one
// for each billboard, and then one for each camera of the hull.
void add_persons(const Set& set, SetScene& scene, Faults& faults);

// Lets a person's hull be what these of its cameras see, 2 or more. The scene has to be built anew
// then. Throws std::invalid_argument if the person has no hull, or as make_hull_material.
void see_hull_by(const Set& set,
                 std::size_t person,
                 std::span<const std::size_t> cameras,
                 SetScene& scene);

// The surfaces that show a video of the scene, as lights. Throws std::invalid_argument as
// render::sample_area_light.
std::vector<render::AreaLight> area_lights_of(const SetScene& scene,
                                              std::size_t video,
                                              std::array<int, 2> samples);

// The set's own lamps.
std::vector<render::LocalLight> describe_lamps(const Set& set);

}  // namespace studio
