// platelight devices: the cameras of this machine.
#include <string>

#include "studio/camera_list.h"
#include "studio/commands/commands.h"

namespace studio {

Command devices_command() {
  return {"devices", "List cameras: formats, sizes, rates, exposure times, controls",
          "platelight devices --json cameras.json",
          [](Arguments&) -> std::function<void(Console&)> {
            return [](Console& console) {
              const capture::V4l2Listing listing = capture::list_v4l2(capture::system_v4l2_io());
              const capture::AravisListing network = capture::list_aravis();
              console.figures(cameras_json(listing, network));
              for (const std::string& line : camera_lines(listing, network)) console.say(line);
            };
          }};
}

}  // namespace studio
