// Set files: video on surfaces, and as light.
#include <algorithm>

#include <fmt/format.h>

#include "render/area_light.h"
#include "render/standard.h"
#include "studio/set_scene.h"
#include "studio/set_sections.h"

namespace studio {
namespace {

using render::Instance;
using render::Mesh;
using render::SceneDescription;

// Those of "OBJECT"; of "OBJECT/PART" those that are named so or, where none is, those whose names
// begin so; all where none is asked for.
std::vector<std::size_t> parts_of(const SetScene& scene, const std::string& object) {
  std::vector<std::size_t> named, begin;
  for (std::size_t i = 0; i < scene.parts.size(); ++i) {
    const std::string& name = scene.description.instances[i].name;
    if (!name.starts_with(object)) continue;
    const bool whole = object.find('/') == std::string::npos;
    if (name == object) named.push_back(i);
    if (object.empty() || !whole || name.size() == object.size() || name[object.size()] == '/')
      begin.push_back(i);
  }
  return named.empty() ? begin : named;
}

std::uint32_t material_of(const Mesh& mesh, std::size_t triangle) {
  return mesh.materials[mesh.materials.size() == 1 ? 0 : triangle];
}

bool has_alpha(const SceneDescription& scene, std::int32_t texture) {
  return texture >= 0 && scene.textures[static_cast<std::size_t>(texture)]->channels % 2 == 0;
}

// The material that shows video `index` in the place of `from`.
render::Material showing(const render::Material& from,
                         const SceneDescription& scene,
                         const VideoSettings& video,
                         std::int32_t index) {
  render::StandardParameters p =
      render::standard_parameters(from, scene.textures.size(), scene.videos.size());
  if (video.lit) {
    if (p.alpha_texture < 0 && has_alpha(scene, p.base_color_texture)) {  // its holes stay
      p.alpha_texture = p.base_color_texture;
      p.alpha_uv = p.base_color_uv;
    }
    std::ranges::copy(video.gain, p.base_color);
    p.base_color_texture = -1;
    p.base_color_video = index;
    p.metallic = p.transmission = 0;
  } else {
    std::ranges::copy(video.gain, p.emission);
    p.emission_gain = 1;
    p.emission_texture = -1;
    p.emission_video = index;
  }
  return render::make_standard_material(from.name, p);
}

// Whether a triangle's material is one that the video covers.
bool is_covered(const render::Material& material, const VideoSettings& video) {
  return material.shader == "standard" &&
         (video.material.empty() || material.name == video.material);
}

// Gives an instance a mesh of its own where it shows the video. False if it shows nothing of it.
bool cover(SceneDescription& scene,
           Instance& instance,
           const VideoSettings& video,
           std::int32_t index) {
  const Mesh& before = *scene.meshes[instance.mesh];
  const bool any = std::ranges::any_of(before.materials, [&](std::uint32_t material) {
    return is_covered(scene.materials[material], video);
  });
  if (!any || before.uvs.empty()) return false;
  Mesh mesh = before;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> replaced;
  for (std::uint32_t& material : mesh.materials) {
    if (!is_covered(scene.materials[material], video)) continue;
    auto found = std::ranges::find(replaced, material, [](const auto& r) { return r.first; });
    if (found == replaced.end()) {
      const auto added = static_cast<std::uint32_t>(scene.materials.size());
      scene.materials.push_back(showing(scene.materials[material], scene, video, index));
      found = replaced.insert(replaced.end(), {material, added});
    }
    material = found->second;
  }
  // Of a lit video, its own colours are those of the surface.
  for (std::size_t t = 0; video.lit && !mesh.colours.empty() && t < mesh.triangles.size(); ++t) {
    if (!is_covered(scene.materials[material_of(before, t)], video)) continue;
    for (const std::uint32_t corner : mesh.triangles[t]) mesh.colours[corner] = {255, 255, 255};
  }
  scene.meshes.push_back(std::make_shared<const Mesh>(std::move(mesh)));
  instance.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
  return true;
}

// Which of the videos any part shows.
std::vector<bool> videos_seen(const SetScene& scene) {
  const SceneDescription& description = scene.description;
  std::vector<bool> used(description.materials.size()), seen(description.videos.size());
  for (std::size_t i = 0; i < scene.parts.size(); ++i) {
    for (const std::uint32_t material :
         description.meshes[description.instances[i].mesh]->materials)
      used[material] = true;
  }
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i] || description.materials[i].shader != "standard") continue;
    const auto p = render::standard_parameters(
        description.materials[i], description.textures.size(), description.videos.size());
    for (const std::int32_t video : {p.emission_video, p.base_color_video}) {
      if (video >= 0) seen[static_cast<std::size_t>(video)] = true;
    }
  }
  return seen;
}

}  // namespace

VideoSettings read_video_section(Section section, const SetContext& context, bool lights) {
  VideoSettings video;
  video.lights = lights;
  section.text("name", video.name);
  section.need("source", "what the surface shows: a file's path or a camera's URI");
  video.source_place = section.place_of("source");
  read_source_key(section, "source", context.base, video.source);
  section.text("object", video.object);
  section.text("material", video.material);
  video.object_place = section.place_of(section.has("object") ? "object" : "material");
  if (!section.has("object") && !section.has("material")) {
    section.fault("", "must have object = \"NAME\" or material = \"NAME\", or both");
  }
  section.boolean("lit", video.lit);
  section.colour("gain", video.gain, {0, video.lit ? 1 : 1e9});
  section.boolean("loop", video.loop);
  read_colour(section, video.colour);
  if (lights) {
    section.integers("samples", video.samples, 1, render::most_area_samples);
    section.number("ambient", video.ambient, {0, 1});
    if (video.lit) {
      section.fault("lit", "is for [[video]]: what is lit gives no light of its own");
    }
  }
  for (const std::string_view key : {"samples", "ambient"}) {
    section.of_use_only(lights, key, "[[video_light]]");
  }
  section.finish();
  return video;
}

void name_videos(std::vector<VideoSettings>& videos, Faults& faults) {
  for (std::size_t i = 0; i < videos.size(); ++i) {
    VideoSettings& video = videos[i];
    if (video.name.empty()) video.name = fmt::format("video {}", i + 1);
    const auto before = std::span(videos).first(i);
    if (std::ranges::find(before, video.name, &VideoSettings::name) != before.end()) {
      faults.add(video.source_place, fmt::format("there are two videos named \"{}\"", video.name));
    }
  }
}

void show_videos(const Set& set, SetScene& scene, Faults& faults) {
  SceneDescription& description = scene.description;
  std::vector<std::size_t> all;  // those that are on anything
  for (const VideoSettings& video : set.videos) {
    const auto index = static_cast<std::int32_t>(description.videos.size());
    description.videos.push_back(video.name);
    bool shown = false;
    for (const std::size_t i : parts_of(scene, video.object))
      shown = cover(description, description.instances[i], video, index) || shown;
    if (shown) {
      all.push_back(static_cast<std::size_t>(index));
    } else {
      faults.add(video.object_place,
                 fmt::format("video \"{}\" is shown nowhere: no object, part or material with "
                             "texture coordinates is named so",
                             video.name));
    }
  }
  const std::vector<bool> seen = videos_seen(scene);
  for (const std::size_t i : all) {
    if (seen[i]) continue;
    faults.add(set.videos[i].object_place,
               fmt::format("video \"{}\" is shown nowhere: those that come after it cover all that "
                           "it is on",
                           set.videos[i].name));
  }
}

std::vector<render::AreaLight> area_lights_of(const SetScene& scene,
                                              std::size_t video,
                                              std::array<int, 2> samples) {
  const SceneDescription& description = scene.description;
  std::vector<render::AreaLight> lights;
  for (std::uint32_t i = 0; i < scene.parts.size(); ++i) {
    const Mesh& mesh = *description.meshes[description.instances[i].mesh];
    std::vector<std::uint32_t> materials;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const std::uint32_t material = material_of(mesh, t);
      if (std::ranges::find(materials, material) == materials.end()) materials.push_back(material);
    }
    for (const std::uint32_t material : materials) {
      if (description.materials[material].shader != "standard") continue;
      const auto p = render::standard_parameters(
          description.materials[material], description.textures.size(), description.videos.size());
      if (p.emission_video != static_cast<std::int32_t>(video)) continue;
      lights.push_back(render::sample_area_light(description, i, material, samples));
    }
  }
  return lights;
}

}  // namespace studio
