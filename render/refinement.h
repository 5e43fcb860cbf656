// Pictures that sharpen while nothing moves: how fine a cell is.
#pragma once

#include "render/frame_job.h"

namespace render {

// A cell may be found coarse, with one camera ray a pixel, then with a few, then as the effort asks
// (FrameJob::stages). Each of these stages takes about four times the rays of the one before, so
// that finding a cell anew costs at most a third more than going on from there, and needs no memory
// of it: a cell's bits depend on its stage alone.
inline constexpr int refinement_stages = 3;
inline constexpr int finished_stage = refinement_stages - 1;

// What a stage, 0 the coarsest, makes of the effort of the finished picture.
Effort effort_of_stage(const Effort& effort, int stage);

}  // namespace render
