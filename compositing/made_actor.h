// A made person before a made green screen, with known alpha: painted once, moved over the frames.
#pragma once

#include <array>
#include <cstdint>

#include "capture/image.h"

namespace compositing {

// Linear albedos are of things that keyers meet.
enum class MadeHair : std::uint8_t { brown, blond, black, white };

struct MadeActor {
  MadeHair hair = MadeHair::brown;
  bool green_clothes = false;  // yellow to teal, drawn; none as saturated as a screen
  bool any_colours = false;    // skin, hair and clothes of random colours, not too near a screen's
  float spill = 0.03F;         // light of the screen on the person, at rims twice that
  float veil = 0;              // opacity of its folds; 0 = none
  float fur = 0;               // its longest hairs, in heights of the picture; 0 = none
  bool glass = false;          // a bottle and a pane in front of the chest
};

// The person's layer has this many texels to a pixel, so that hair is thinner than a pixel.
inline constexpr int actor_detail = 3;

// What a layer holds: premultiplied red, green, blue without spill, alpha, and the spill as a share
// of the screen's light (premultiplied too).
inline constexpr int actor_channels = 5;
using ActorColour = std::array<float, 3>;

// The layer (actor_detail * height, actor_detail * width, actor_channels), each texel the mean over
// one pixel's square around it. The head is at the middle, the chest cut by the lower edge. The
// same seed gives the same person.
capture::Image paint_actor(const MadeActor& actor, std::uint32_t seed, int height, int width);

// Colour of the sleeve of the arm that is painted into each frame, and of its hand.
ActorColour sleeve_of(const MadeActor& actor, std::uint32_t seed);
ActorColour skin_of(const MadeActor& actor, std::uint32_t seed);

}  // namespace compositing
