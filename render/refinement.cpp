// Stages of cells.
#include "render/refinement.h"

#include <algorithm>

namespace render {

namespace {

constexpr float coarsest_accuracy = 0.5F, coarse_accuracy = 0.8F;
constexpr float coarse_contrast = 0.4F, blended_contrast = 0.1F;
// Of what the effort allows: of the standard error of pixels, and of the light that is cut.
constexpr float finer_tolerance = 0.4F, finer_cuts = 1.0F / 3;

}  // namespace

int block_of_stage(int stage) { return 1 << std::max(one_ray_stage - stage, 0); }

Effort effort_of_stage(const Effort& effort, int stage) {
  if (stage == finished_stage) return effort;
  if (stage > finished_stage) {
    if (!can_be_finer(effort)) return effort;
    Effort finer = effort;
    finer.aa_tolerance *= finer_tolerance;
    finer.accuracy = 1 - finer_cuts * (1 - effort.accuracy);
    finer.adaptive_visibility = false;
    return finer;
  }
  Effort coarse = effort;
  coarse.chance_cuts = false;  // of few rays it is noise
  // Takes shadow rays, and of blocks too few pixels would look for parts.
  if (stage < few_rays_stage) coarse.soft_lights = false;
  const bool blocks = stage < one_ray_stage;
  coarse.accuracy =
      std::min(effort.accuracy, stage < few_rays_stage ? coarsest_accuracy : coarse_accuracy);
  // Of a block, the pixel that stands for all would see the same share of the lights everywhere.
  if (blocks) coarse.interleave = 1;
  if (stage > one_ray_stage) {
    coarse.aa_samples = std::min(effort.aa_samples, 4);
    coarse.aa_tolerance = 0;  // more of them where these are uncertain come with the next stage
    if (effort.glint_contrast > 0) {
      coarse.glint_contrast = std::max(effort.glint_contrast, coarse_contrast);
    }
  } else {
    coarse.aa_samples = 1;
  }
  return coarse;
}

bool can_be_finer(const Effort& effort) { return effort.aa_samples > 1 && effort.aa_tolerance > 0; }

float blend_contrast_of_stage(const Effort& effort, int stage) {
  if (stage < smoothed_stage || stage >= finished_stage || !(effort.glint_contrast > 0)) return 0;
  return std::max(effort.glint_contrast, blended_contrast);
}

}  // namespace render
