// Two scene descriptions made one.
#pragma once

#include <array>

#include "render/scene.h"

namespace render {

// Rows of a 3x4 matrix whose fourth row is 0 0 0 1, as Instance::set_from_object.
using Placement = std::array<float, 12>;
inline constexpr Placement as_it_stands{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

// A point moved by `b`, and then by `a`.
Placement product(const Placement& a, const Placement& b);

// Turned by yaw_rad about z (counter-clockwise, seen from above), then moved.
Placement placed(Vec3f position, float yaw_rad);

// Adds all that is in `part` to `whole`, its instances moved by `set_from_part`. The parts of both
// keep their order; indices of `part` move up. Materials of the shader "standard" have their
// textures moved as well; other shaders name none.
void join(SceneDescription& whole,
          const SceneDescription& part,
          const Placement& set_from_part = as_it_stands);

}  // namespace render
