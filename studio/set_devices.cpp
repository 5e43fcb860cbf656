// Set files: devices, which can be opened only once.
#include <algorithm>

#include <fmt/format.h>

#include "capture/camera.h"
#include "studio/set_sections.h"

namespace studio {
namespace {

constexpr std::string_view the_plate = "the plate";

struct DeviceUse {
  std::string device;  // its URI without settings
  std::string uri, what;
  const VideoSettings* video;  // if it is one
};

// Whether the second one shows what is open for the first (VideoFeed).
bool are_one(const DeviceUse& first, const DeviceUse& second) {
  if (second.video == nullptr || first.uri != second.uri) return false;
  if (first.video == nullptr) return first.what == the_plate;
  return first.video->loop == second.video->loop && first.video->colour == second.video->colour;
}

}  // namespace

void refuse_shared_devices(const Set& set, Faults& faults) {
  std::vector<DeviceUse> uses;
  const auto add = [&](const std::string& uri, const std::string& what, Place place,
                       const VideoSettings* video = nullptr) {
    if (!capture::is_device(uri)) return;
    const DeviceUse use{uri.substr(0, uri.find('?')), uri, what, video};
    const auto before = std::ranges::find(uses, use.device, &DeviceUse::device);
    if (before == uses.end()) {
      uses.push_back(use);
    } else if (!are_one(*before, use)) {
      const bool may_share = video && before->what == the_plate;
      faults.add(
          place,
          fmt::format("{} is {}'s already, and can be opened only once{}", use.device, before->what,
                      may_share ? ": to show the plate, write its source as there" : ""));
    }
  };
  add(set.camera.source, std::string(the_plate), set.camera.source_place);
  if (set.probe) add(set.probe->source, "the probe", set.probe->source_place);
  for (const VideoSettings& video : set.videos) {
    add(video.source, fmt::format("video \"{}\"", video.name), video.source_place, &video);
  }
  for (std::size_t i = 0; i < set.persons.size(); ++i) {
    const PersonSettings& person = set.persons[i];
    const std::string name = person.name.empty() ? fmt::format("person {}", i + 1)
                                                 : fmt::format("person \"{}\"", person.name);
    for (const PersonCamera& camera : person.cameras) add(camera.source, name, camera.place);
  }
}

}  // namespace studio
