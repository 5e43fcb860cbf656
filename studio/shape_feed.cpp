// Shapes, frame by frame.
#include "studio/shape_feed.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "render/load_shape.h"

namespace studio {
namespace {

bool same_shapes(const ObjectSettings& a, const ObjectSettings& b) {
  return a.shapes == b.shapes && a.hide == b.hide;
}

// Which file has shape number n.
std::size_t file_of(const ShapeSettings& shapes, std::int64_t n) {
  return static_cast<std::size_t>(n % static_cast<std::int64_t>(shapes.files.size()));
}

// Which shape is due when so much time has passed: past the last one, that.
std::int64_t number_at(const ShapeSettings& shapes, capture::Time passed, capture::Rational fps) {
  const std::int64_t number = capture::frame_at(passed, fps);
  const auto count = static_cast<std::int64_t>(shapes.files.size());
  return shapes.loop ? number : std::min(number, count - 1);
}

// Whether that changed anything.
bool put(const ReadShape& shape, const std::vector<std::size_t>& meshes, SetScene& scene) {
  bool changed = false;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    auto& mesh = scene.description.meshes[meshes[i]];
    changed = changed || mesh != shape.meshes[i];
    mesh = shape.meshes[i];
  }
  return changed;
}

}  // namespace

ShapeFeed::ShapeFeed(const Set& set,
                     SetScene& scene,
                     capture::Rational rate,
                     std::optional<capture::Time> start,
                     bool live,
                     const ShapeFeed* before)
    : live_(live), period_(capture::time_of_frame(1, rate)) {
  for (std::size_t object = 0; object < set.objects.size(); ++object) {
    const ObjectSettings& settings = set.objects[object];
    if (!settings.shapes || std::ranges::any_of(channels_, [&](const Channel& c) {
          return same_shapes(c.settings, settings);
        })) {
      continue;
    }
    Channel& channel = channels_.emplace_back();
    channel.settings = settings;
    channel.name = name_of(settings, object + 1);
    channel.fps = settings.shapes->fps.value_or(rate);
    channel.start = start;
    open(channel, set, scene);
    if (before != nullptr) go_on(channel, *before, scene);
    channel.reader->want(files_from(channel, capture::time_of_frame(channel.shown, channel.fps)));
  }
}

// Finds what it deforms, and begins to read.
void ShapeFeed::open(Channel& channel, const Set& set, const SetScene& scene) {
  const render::SceneDescription& description = scene.description;
  std::vector<render::DeformingPart> parts;
  std::vector<ShapedMesh> shaped;
  for (std::size_t i = 0; i < scene.parts.size(); ++i) {
    const ObjectPart& part = scene.parts[i];
    if (!same_shapes(set.objects[part.object], channel.settings)) continue;
    const std::size_t mesh = description.instances[i].mesh;
    if (std::ranges::find(channel.meshes, mesh) != channel.meshes.end()) continue;
    channel.meshes.push_back(mesh);
    channel.parts.push_back(part.number);
    shaped.push_back({part.number, description.meshes[mesh]});
    if (part.number >= parts.size()) parts.resize(part.number + 1);
    parts[part.number] = {part.name, description.meshes[mesh]};
  }
  const ShapeSettings& shapes = *channel.settings.shapes;
  channel.told.resize(shapes.files.size());
  channel.reader = std::make_unique<ShapeReader>(shapes.files, load_options(channel.settings),
                                                 std::move(parts), std::move(shaped), shapes.loop);
}

// Takes over where the same shapes are in another set's scene.
void ShapeFeed::go_on(Channel& channel, const ShapeFeed& before, SetScene& scene) {
  const auto same = std::ranges::find_if(before.channels_, [&](const Channel& c) {
    return same_shapes(c.settings, channel.settings) && c.fps == channel.fps;
  });
  if (same == before.channels_.end()) return;
  channel.start = same->start;
  channel.told = same->told;
  if (same->shape == nullptr) return;
  auto shape = std::make_shared<ReadShape>();
  for (std::size_t i = 0; i < channel.meshes.size(); ++i) {
    const render::Mesh& mesh = *scene.description.meshes[channel.meshes[i]];
    const auto part = std::ranges::find(same->parts, channel.parts[i]);
    // The first file may be another one by now.
    if (part == same->parts.end()) return;
    const render::Mesh& now =
        *same->shape->meshes[static_cast<std::size_t>(part - same->parts.begin())];
    if (now.positions.size() != mesh.positions.size() ||
        now.normals.size() != mesh.normals.size() || now.tangents.size() != mesh.tangents.size()) {
      return;
    }
    shape->meshes.push_back(render::in_shape(mesh, {now.positions, now.normals, now.tangents}));
  }
  gone_on_ = put(*shape, channel.meshes, scene) || gone_on_;
  channel.shape = std::move(shape);
  channel.shown = same->shown;
  channel.begins = true;
  channel.told_late = same->told_late;
}

// What the show's next frames show, as many as are read ahead.
std::vector<std::size_t> ShapeFeed::files_from(const Channel& channel, capture::Time passed) const {
  std::vector<std::size_t> files;
  for (std::size_t i = 0; i < channel.reader->ahead(); ++i, passed += period_) {
    const ShapeSettings& shapes = *channel.settings.shapes;
    const std::size_t file = file_of(shapes, number_at(shapes, passed, channel.fps));
    if (std::ranges::find(files, file) == files.end()) files.push_back(file);
  }
  return files;
}

bool ShapeFeed::at(capture::Time time, SetScene& scene) {
  bool changed = std::exchange(gone_on_, false);
  held_ = 0;
  for (Channel& channel : channels_) changed = update(channel, time, scene) || changed;
  return changed;
}

bool ShapeFeed::update(Channel& channel, capture::Time time, SetScene& scene) {
  if (!channel.start) channel.start = time;
  const ShapeSettings& shapes = *channel.settings.shapes;
  ShapeReader& reader = *channel.reader;
  const capture::Time passed = std::max(time - *channel.start, capture::Time::zero());
  const std::int64_t number = number_at(shapes, passed, channel.fps);
  const std::size_t file = file_of(shapes, number);
  std::vector<std::size_t> next = files_from(channel, passed);

  std::shared_ptr<const ReadShape> due, newest;
  std::int64_t newest_number = number;
  if (live_) {
    due = reader.find(file);
    // Among those since the one that is shown, of which none comes twice.
    const auto count = static_cast<std::int64_t>(shapes.files.size());
    const std::int64_t oldest = std::max(channel.shown, number - count);
    for (; newest_number > oldest; --newest_number) {
      newest = reader.find(file_of(shapes, newest_number));
      if (newest && newest->why_not.empty()) break;
    }
    reader.want(std::move(next));
  } else {
    reader.want(std::move(next));
    due = newest = reader.wait_for(file);
  }
  bool changed = false;
  if (newest && newest->why_not.empty()) {
    changed = put(*newest, channel.meshes, scene);
    channel.shape = std::move(newest);
    channel.shown = newest_number;
  }
  if (file_of(shapes, channel.shown) == file) {
    channel.begins = false;
  } else {
    note_held(channel, file, due.get());
  }
  return changed;
}

// Once for each file that is bad, and once for all that are late.
void ShapeFeed::note_held(Channel& channel, std::size_t file, const ReadShape* due) {
  ++held_;
  if (due == nullptr) {
    if (!channel.begins && !channel.told_late) {
      notes_.push_back(
          fmt::format("object {}: {} is not read in time: the newest shape that is stays, as "
                      "wherever one is late",
                      channel.name, channel.reader->files()[file]));
      channel.told_late = true;
    }
    return;
  }
  if (channel.told[file]) return;
  notes_.push_back(
      fmt::format("object {}: {}: the shape that it has stays", channel.name, due->why_not));
  channel.told[file] = true;
}

std::vector<std::string> ShapeFeed::take_notes() { return std::exchange(notes_, {}); }

}  // namespace studio
