// Plate, lens, track and scene of a set.
#include "studio/show_inputs.h"

#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "calibrate/vignetting.h"

namespace studio {
namespace {

[[noreturn]] void fail(const Set& set, Place place, const std::string& message) {
  throw SetError({{set.path, place.line, place.column, message}});
}

}  // namespace

std::shared_ptr<render::Scene> compile(const Set& set,
                                       const PersonFeed& persons,
                                       SetScene& described,
                                       std::uint64_t version) {
  described.description.version = version;
  try {
    return std::make_shared<render::Scene>(described.description, persons.nothing_yet());
  } catch (const std::invalid_argument& error) {
    fail(set, {}, error.what());
  }
}

std::unique_ptr<Source> open_plate(const Set& set) {
  const CameraSettings& camera = set.camera;
  capture::CameraOptions options;
  options.colour.transfer = camera.colour;
  options.frame = camera.frame;
  options.crop = camera.crop;
  options.loop = camera.loop;
  options.deinterlace = camera.deinterlace;
  options.response = camera.response;
  if (set.show.fps) options.picture_rate = *set.show.fps;
  std::unique_ptr<Source> source;
  try {
    source = std::make_unique<Source>(capture::open_camera(camera.source, options));
  } catch (const std::runtime_error& error) {
    fail(set, camera.source_place, error.what());
  } catch (const std::invalid_argument& error) {
    fail(set, camera.source_place, error.what());
  }
  const capture::CameraInfo& info = source->info();
  if (info.width != set.show.width || info.height != set.show.height) {
    fail(set, camera.source_place,
         fmt::format("the plate's picture is {}x{}, but the show is {}x{}: set show.width and "
                     "show.height, or camera.crop",
                     info.width, info.height, set.show.width, set.show.height));
  }
  const auto [width, height] = camera.lens_size;
  const bool whole_known = width > 0 && info.whole_width > 0;
  if (camera.crop && whole_known && (width != info.whole_width || height != info.whole_height)) {
    fail(set, camera.source_place,
         fmt::format("the plate's whole picture is {}x{}, but its lens is for {}x{}",
                     info.whole_width, info.whole_height, width, height));
  }
  return source;
}

bool same_plate(const Set& a, const Set& b) {
  return a.camera.source == b.camera.source && a.camera.frame == b.camera.frame &&
         a.camera.crop == b.camera.crop && a.camera.colour == b.camera.colour &&
         a.camera.response == b.camera.response && a.camera.loop == b.camera.loop &&
         a.camera.deinterlace == b.camera.deinterlace;
}

void require_same_plate(const Set& before, const Set& after) {
  const ShowSettings &a = before.show, &b = after.show;
  if (a.width != b.width || a.height != b.height || a.fps != b.fps) {
    throw std::invalid_argument("the picture's size and rate cannot change on air: start anew");
  }
  if (!same_plate(before, after)) {
    throw std::invalid_argument("the plate's source cannot change on air: start anew");
  }
}

calibrate::Lens lens_of(const Set& set) {
  if (set.camera.lens.width > 0) return set.camera.lens;
  // A set without objects needs no lens; the kernel wants directions all the same.
  const auto [width, height] = std::pair(set.show.width, set.show.height);
  return {"pinhole",
          width,
          height,
          {static_cast<double>(width), static_cast<double>(width), (width - 1) / 2.0,
           (height - 1) / 2.0}};
}

std::shared_ptr<const calibrate::DirectionTable> directions_of(const Set& set) {
  auto directions =
      std::make_shared<calibrate::DirectionTable>(calibrate::make_direction_table(lens_of(set)));
  calibrate::add_vignetting(set.camera.vignetting, *directions);
  return directions;
}

std::optional<calibrate::Track> track_of(const Set& set) {
  if (set.camera.pose.track.empty()) return std::nullopt;
  try {
    return calibrate::read_track(set.camera.pose.track);
  } catch (const std::runtime_error& error) {
    fail(set, set.camera.pose_place, error.what());
  }
}

}  // namespace studio
