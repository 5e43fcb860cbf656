// What the program begins with: registrations, signals, environment.
#include "studio/start.h"

#include <csignal>
#include <cstdlib>

#include "compositing/made_walker_camera.h"
#include "compositing/stand_in.h"
#include "render/made_camera.h"

namespace studio {

void start() {
  // Whoever reads what is said may go: writing then fails, and is no reason to end.
  std::signal(SIGPIPE, SIG_IGN);
  // A file that may grow no larger is as a full disk: writing fails, and says so.
  std::signal(SIGXFSZ, SIG_IGN);
  // These would rule our own configuration, which is made in code; sets name no other.
  for (const char* name : {"OCIO_ACTIVE_DISPLAYS", "OCIO_ACTIVE_VIEWS", "OCIO_INACTIVE_COLORSPACES",
                           "OCIO_OPTIMIZATION_FLAGS"}) {
    ::unsetenv(name);
  }
  compositing::register_shaders();
  render::register_made_cameras();
  compositing::register_made_walkers();
}

}  // namespace studio
