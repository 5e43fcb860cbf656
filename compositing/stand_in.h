// Shaders of augmented pictures: the stand-in, and the plate as background.
#pragma once

#include "render/mesh.h"
#include "render/stand_in_parameters.h"

namespace compositing {

// Registers the shaders "stand_in", "billboard" (billboard.h) and "hull" (visual_hull.h), and the
// background "plate". Call once, before scenes are built.
//
// A stand-in is a real surface that the plate shows. Per colour it gives
//   out = plate (1 - lost/E) + (albedo/pi) E_virtual + F (L_hit - L_env),
// where E is the irradiance of the real light there, lost what virtual objects take away of it,
// E_virtual that of virtual lamps, F Fresnel's share and L_hit what the mirrored ray hits. Each
// term is exactly 0 where nothing virtual changes the light. The albedo is pi plate / E, or the
// set's own where E or the plate is too dark or clipped. F's term may take light away, but leaves
// no pixel darker than black that was not so before.
//
// One that occludes (Instance::occludes) hides virtual objects behind it. One that does not only
// catches light: it shows where no virtual object is seen before it or behind it, as far as the
// next one that does occlude.
//
// One that mirrors show (Instance::mirrored) is in them what the plate shows at its place, times
// (1 - lost/E) there; beyond the picture, the environment.
//
// Debevec, "Rendering Synthetic Objects into Real Scenes", SIGGRAPH 1998, section 5 (differential
// rendering), as ratios instead of differences: the plate's own texture stays under the shadow.
void register_shaders();

// A material of the shader "stand_in".
render::Material make_stand_in_material(std::string name,
                                        const render::StandInParameters& parameters);

}  // namespace compositing
