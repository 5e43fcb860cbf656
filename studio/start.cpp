// Registrations.
#include "studio/start.h"

#include <csignal>

#include "compositing/made_walker_camera.h"
#include "compositing/stand_in.h"
#include "render/made_camera.h"

namespace studio {

void start() {
  // Whoever reads what is said may go: writing then fails, and is no reason to end.
  std::signal(SIGPIPE, SIG_IGN);
  compositing::register_shaders();
  render::register_made_cameras();
  compositing::register_made_walkers();
}

}  // namespace studio
