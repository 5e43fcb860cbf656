// What a URI asks of a made camera. For the made cameras only.
#pragma once

#include <string>
#include <string_view>

#include "render/made_studio.h"

namespace render {

struct MadeCameraRequest {
  bool probe = false;  // else the plate
  bool gige = false;   // over packets, as time goes by
  MadeStudioSettings studio;
  int frames = 0;
  int samples = 4;
  int rate = 0;            // of a GigE camera: frames a second, 0 = the studio's
  int lag = 2;             // of a GigE camera: frames until an exposure has effect
  int loss_per_mille = 0;  // of a GigE camera's packets
};

// Of what stands behind "made:". Throws std::runtime_error with the URI, reason and what to write.
MadeCameraRequest parse_made_camera(std::string_view uri);
[[noreturn]] void refuse_made_camera(std::string_view uri, const std::string& why);

}  // namespace render
