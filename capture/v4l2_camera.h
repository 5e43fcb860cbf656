// V4L2 devices as cameras: v4l2:/dev/video0.
#pragma once

#include <memory>
#include <string_view>

#include "capture/camera.h"
#include "capture/linearise.h"
#include "capture/v4l2_io.h"

namespace capture {

// Opens what v4l2: names (see parse_v4l2 and cameras.md), and waits for its first picture. Frames
// come as the device fills its buffers; next() waits for them. Gaps in the device's numbers and
// time-outs are lost frames, pictures that driver or decoder call faulty are damaged ones. A device
// that fails or is unplugged gives lost frames at its rate until the same one (bus and name, not
// node number) is back, with all its settings and the exposure that was asked for last.
//
// Throws std::runtime_error naming the device, what was asked, and what is possible.
std::unique_ptr<Camera> open_v4l2(std::string_view rest,
                                  const CameraOptions& options,
                                  const LightCurves& curves,
                                  std::shared_ptr<V4l2Io> io = system_v4l2_io());

}  // namespace capture
