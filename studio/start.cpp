// Registrations.
#include "studio/start.h"

#include "compositing/made_walker_camera.h"
#include "compositing/stand_in.h"
#include "render/made_camera.h"

namespace studio {

void start() {
  compositing::register_shaders();
  render::register_made_cameras();
  compositing::register_made_walkers();
}

}  // namespace studio
