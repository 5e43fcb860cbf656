// The made studio's cameras as GigE Vision cameras: made:gige_plate and made:gige_probe.
#pragma once

#include <memory>

#include "capture/camera.h"
#include "render/made_camera_request.h"

namespace render {

// A camera in this process that sends real packets over the loopback network, and the aravis:
// camera that reads them. All of one process see the same sun at the same time. Its exposures are
// those that it is told. Throws std::runtime_error as open_camera.
std::unique_ptr<capture::Camera> open_made_gige(const MadeCameraRequest& request,
                                                const capture::CameraOptions& options);

}  // namespace render
