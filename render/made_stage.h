// A made stage with persons on it: a virtual set.
#pragma once

#include <cstddef>

#include "render/scene.h"

namespace render {

// As many triangles as the billboards of Pomi et al. (VMV 2003, table 1), and those of the glass
// sphere in front of them.
inline constexpr std::size_t made_stage_triangles = 424;
inline constexpr std::size_t glass_sphere_triangles = 400;

// A stage seen from -y: polished floor, walls, columns, a round podium, a pedestal, a mirror. Two
// persons, "person_1" and "person_2", stand on the floor as rectangles of two triangles that face
// the viewer, upright over texture coordinates 0..1; their materials have the same names, and
// texels of alpha below a half are holes. All materials are of the shader "standard".
SceneDescription make_stage();

// A solid sphere of glass, to stand on the pedestal before a person. Its vertex normals are those
// of the sphere; material "glass sphere" of the shader "glass".
inline constexpr Vec3f glass_sphere_middle{0.62F, -1.15F, 1.13F};
inline constexpr float glass_sphere_radius_m = 0.34F;
SceneDescription make_glass_sphere();

}  // namespace render
