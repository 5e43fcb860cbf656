// The parameter block of the shader "stand_in": how a real surface answers to virtual objects.
#pragma once

#include <cstdint>

namespace render {

// Plain bytes, as every parameter block. The shader itself lives in compositing; the block is here
// because the reference renders stand-ins too.
struct StandInParameters {
  float albedo[3] = {0.2F, 0.2F, 0.2F};  // of the real surface, where the plate does not tell it
  float reflectance = 0;                 // at normal incidence (Schlick's F0); 0 = no reflection
  float roughness = 0;                   // of that reflection
  std::uint32_t catches_shadow = 1;      // switches, 0 or 1
  std::uint32_t catches_reflection = 0;
  std::uint32_t catches_light = 1;  // of virtual lamps
  std::uint32_t occludes = 1;       // hides virtual objects behind it
};

}  // namespace render
