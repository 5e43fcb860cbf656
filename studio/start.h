// What must be known before any set is opened.
#pragma once

namespace studio {

// Registers shaders and made cameras. From then on writing fails, and ends nothing, where nobody
// reads or a file may not grow; OpenColorIO's variables in the environment are gone. Call once,
// before threads.
void start();

}  // namespace studio
