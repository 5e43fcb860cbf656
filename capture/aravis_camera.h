// GigE Vision and USB3 Vision cameras by Aravis: aravis:NAME.
#pragma once

#include <memory>
#include <string_view>

#include "capture/camera.h"
#include "capture/linearise.h"

namespace capture {

// Opens what aravis: names (see parse_aravis and cameras.md), and waits for its first picture.
// Gaps in the camera's numbers are lost frames, pictures with missing packets damaged ones. A
// camera that is silent gives lost frames at its rate, from three frames' time after its last one
// on; it is looked for until it is back, and gets all its settings again.
//
// Throws std::runtime_error naming the device, what was asked, and what is possible.
std::unique_ptr<Camera> open_aravis(std::string_view rest,
                                    const CameraOptions& options,
                                    const LightCurves& curves);

}  // namespace capture
