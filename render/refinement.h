// Pictures that sharpen while nothing moves: how fine a cell is.
#pragma once

#include "render/frame_job.h"

namespace render {

// A cell may be found coarse, with one camera ray for 8x8 pixels, then for 4x4, for 2x2, for each,
// then with its edges smoothed by rays that only see what is there, then with a few rays for pixels
// that need them, then as the effort asks, and at last finer than that (FrameJob::stages).
// Smoothing takes hardly more than one ray a pixel, each other stage two to four times the rays of
// the one before, so that finding a cell anew costs little more than going on from there, and needs
// no memory of it: a cell's bits depend on its stage alone.
inline constexpr int one_ray_stage = 3;  // a camera ray in every pixel
inline constexpr int smoothed_stage = 4;
inline constexpr int few_rays_stage = 5;
inline constexpr int finished_stage = 6;  // as the effort asks
inline constexpr int finer_stage = 7;     // for what stands still, where there is time
inline constexpr int refinement_stages = finer_stage + 1;

// Pixels a side, 1, 2, 4 or 8, that share a camera ray. The plate is each pixel's own.
int block_of_stage(int stage);

// What a stage, 0 the coarsest, makes of the effort of the finished picture.
Effort effort_of_stage(const Effort& effort, int stage);

// Whether the last stage is any finer than the finished one: not where no pixel takes more rays for
// being uncertain.
bool can_be_finer(const Effort& effort);

// By how much neighbours of one surface differ that are blended there, where no ray is worth it
// yet; 0 = none are. As Effort::glint_contrast.
float blend_contrast_of_stage(const Effort& effort, int stage);

}  // namespace render
