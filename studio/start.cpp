// Registrations.
#include "studio/start.h"

#include "compositing/stand_in.h"

namespace studio {

void start() { compositing::register_shaders(); }

}  // namespace studio
