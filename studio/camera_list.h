// The cameras that there are, in words and as figures.
#pragma once

#include <string>
#include <vector>

#include "capture/aravis_device.h"
#include "capture/v4l2_device.h"

namespace studio {

// One line after the other, without line ends; says so if there is no camera.
std::vector<std::string> camera_lines(const capture::V4l2Listing& listing,
                                      const capture::AravisListing& network = {});

// {"cameras": [{"uri", "path", "bus", "name", "driver", "modes": [{"format", "read", "min_size",
// "max_size", "rates", "rates_between"}], "exposure_s": [shortest, longest] or null, "controls":
// [{"name", "low", "high", "step", "default", "value", "settable", "inactive"}]}],
// "closed": [{"path", "reason"}]}; GigE Vision and USB3 Vision cameras are among the cameras as
// {"uri", "id", "vendor", "model", "serial", "address", "protocol", "formats": [{"format",
// "read"}], "min_size", "max_size", "rates": [lowest, highest] or null, "exposure_s", "fault"}.
std::string cameras_json(const capture::V4l2Listing& listing,
                         const capture::AravisListing& network = {});

}  // namespace studio
