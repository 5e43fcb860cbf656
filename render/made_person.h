// A made person: a picture with alpha, for billboards.
#pragma once

#include "render/mesh.h"

namespace render {

// Linear albedos and what the person wears. Lengths are metres.
struct MadePerson {
  Vec3f skin{0.52F, 0.33F, 0.24F};
  Vec3f hair{0.06F, 0.035F, 0.02F};
  Vec3f top{0.08F, 0.16F, 0.36F};
  Vec3f legs{0.05F, 0.055F, 0.075F};
  Vec3f shoes{0.025F, 0.02F, 0.018F};
  float hair_m = 0.04F;    // how far it falls below the ears
  float skirt = 0;         // 1 = a skirt to the knees in the colour of `legs`
  float sleeve = 1;        // share of the arm that it covers
  float raised_arm = 0;    // of the picture's right arm: 1 = it points to the side
  float height_share = 1;  // of 1.77 m
};

// Size of the person's picture in the set; the feet stand on its lower edge.
inline constexpr float made_person_width_m = 0.96F, made_person_height_m = 1.92F;

// The person from the front: sRGB and (unassociated) alpha, soft over a texel and a half, with mip
// levels. `height` texels high, half as wide. The same person gives the same texels. Throws
// std::invalid_argument as make_texture().
Texture make_person_texture(const MadePerson& person, int height);

}  // namespace render
