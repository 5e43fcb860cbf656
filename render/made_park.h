// The made park: a parking place on a lawn, with a real map of light as its distance.
#pragma once

#include "render/made_studio.h"

namespace render {

// 1280x720, eight frames.
MadeStudioSettings park_settings();

// How the park's plate is exposed: plate radiance for one unit of the map's, 1 = display white.
inline constexpr float park_exposure = 1.6F;

// A square of asphalt about the origin, kerbs, a lawn around it: all of it made, near, and lit by
// `map`, which is also what is seen where it ends. The map is a latitude-longitude picture as
// environment_from_map takes it, whose middle column lies towards +x; it is infinitely far, so what
// it shows of the ground nearby is hidden by the lawn. Its light stands still. What is brighter
// than everything but a sun is in sky.sun, the rest in sky.rest.
//
// The plate camera stands on a tripod and pans from left to right over all frames (plate.track);
// its lens sits before the axis that it turns about. The probe takes four exposures in turn, of
// which the shortest does not clip a sun of a radiance of 90,000 in the map's units: as a real one
// would behind a dark filter.
//
// The same arguments give the same studio. Throws std::invalid_argument for a map that
// environment_from_map refuses or that is dark, and as make_studio.
MadeStudio make_park(const capture::Image& map, const MadeStudioSettings& settings);

}  // namespace render
