// The shaders that render itself brings.
#pragma once

#include <memory>

#include "render/shader.h"

namespace render {

// "standard": standard.h's surface.
std::shared_ptr<const Shader> make_standard_shader();
// "glass": glass.h's bodies.
std::shared_ptr<const Shader> make_glass_shader();
// "environment": camera rays that leave the scene see the environment.
std::shared_ptr<const BackgroundShader> make_environment_background();

}  // namespace render
