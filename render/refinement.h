// Pictures that sharpen while nothing moves: how fine a cell is.
#pragma once

#include "render/frame_job.h"

namespace render {

// A cell may be found coarse, with one camera ray for 8x8 pixels, then for 4x4, for 2x2, for each,
// then with a few for those that need them, then as the effort asks (FrameJob::stages). Each of
// these stages takes about four times the rays of the one before, so that finding a cell anew costs
// at most a third more than going on from there, and needs no memory of it: a cell's bits depend on
// its stage alone.
inline constexpr int refinement_stages = 6;
inline constexpr int one_ray_stage = 3;  // a camera ray in every pixel
inline constexpr int finished_stage = refinement_stages - 1;

// Pixels a side, 1, 2, 4 or 8, that share a camera ray. The plate is each pixel's own.
int block_of_stage(int stage);

// What a stage, 0 the coarsest, makes of the effort of the finished picture.
Effort effort_of_stage(const Effort& effort, int stage);

}  // namespace render
