// What must be known before any set is opened.
#pragma once

namespace studio {

// Registers the shaders of compositing. Call once, before threads.
void start();

}  // namespace studio
