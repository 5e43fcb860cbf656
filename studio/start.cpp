// What the program begins with: registrations, signals, environment.
#include "studio/start.h"

#include <malloc.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <thread>

#include "compositing/made_walker_camera.h"
#include "compositing/stand_in.h"
#include "render/made_camera.h"

namespace studio {

void start() {
  // What short-lived threads let go stays in the arenas that they had: with eight for each
  // processor, as is the rule, edits on air let the program grow to several times its size.
  constexpr int fewest_arenas = 4;
  ::mallopt(M_ARENA_MAX,
            std::max(fewest_arenas, static_cast<int>(std::thread::hardware_concurrency())));
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
