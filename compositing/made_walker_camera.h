// Cameras about the made walker as sources of frames.
#pragma once

#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "compositing/made_walker.h"

namespace compositing {

// Where a made camera that looks at the walker stands: `round_deg` round from one on -y, 4 m from
// the set's origin, 1.4 m above its floor, looking at 0.9 m. And its lens: a pinhole of one and a
// half times the picture's height.
calibrate::Pose walker_camera_pose(double round_deg);
calibrate::Lens walker_camera_lens(int width, int height);

// The walker that they film, 25 frames a second, and when in its walk a frame is: it comes towards
// 30 degrees, past the origin, for 32 frames, and then anew. Frames before the 8th show nobody.
MadeWalker filmed_walker();
inline constexpr int frames_of_nobody = 8, frames_of_walk = 32;
double walk_time_s(std::int64_t frame);

// Registers the scheme "made_walker" with capture::open_camera. Call once at start-up.
//
//     made_walker:round=60&width=280&height=350&frames=0&detail=3
//
// All settings are optional: `round` is where the camera stands, in degrees, -360 to 360; `frames`
// are those that come before the end, 0 (the default) = without end; a pixel is the mean of
// `detail` by `detail` rays. What it films is the walker before a green screen, with noise, as
// 8-bit sRGB codes that are decoded by options.colour. Each frame is the same however often it is
// asked for. options.loop changes nothing; a crop is refused.
void register_made_walkers();

}  // namespace compositing
