// Fill and key of a finished picture, for an external keyer that has the plate.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "capture/image.h"
#include "compositing/display.h"
#include "compositing/tone.h"

namespace compositing {

// Splits programmes into fill and key, in the display's codes of 8 bits, such that a keyer's
//
//   fill + (255 - key) * plate / 255
//
// with the plate in the same display's codes is the programme again: with the quotient rounded to
// the nearest, every code of every pixel. The fill is shaped (premultiplied) and never negative.
//
// 255 - key is (1 - A) of the plate's codes, less what a shadow takes of them: as keyers have it,
// coverage A counts in codes. A shadow counts by what the display makes of it: one that takes half
// of the light takes .25 of the codes at Rec.1886, and leaves nothing of the plate in the fill,
// whatever plate the keyer has. Where the fill of a channel would still be negative (a shadow that
// takes more of one colour than the matte, their mean, says), the key is raised until it is 0.
//
// Porter and Duff, "Compositing Digital Images", SIGGRAPH 1984, section 4: `over`, here in codes.
//
// Keeps row buffers, so it belongs to one thread.
class FillAndKey {
 public:
  // Throws std::invalid_argument without a display.
  explicit FillAndKey(std::shared_ptr<const Display> display);

  // `programme` are (height, width, 3) codes, made by the same display with the same tone from
  // `rgba` (height, width, 4), a picture over `plate` (height, width, 3) with `matte` (height,
  // width, 1). `fill` is (height, width, 3), `key` (height, width). On the calling thread;
  // allocates only when the width grows. Returns in how many pixels the key was raised. Throws
  // std::invalid_argument if the sizes do not agree.
  std::int64_t split(std::span<const std::uint8_t> programme,
                     const capture::HalfImage& rgba,
                     const capture::HalfImage& plate,
                     const capture::HalfImage& matte,
                     const ToneCurve& tone,
                     std::span<std::uint8_t> fill,
                     std::span<std::uint8_t> key);

 private:
  std::shared_ptr<const Display> display_;
  std::vector<float> passed_;        // by the bits of a share of light: the share of codes
  std::vector<std::uint8_t> clear_;  // by a matte's bits, where nothing covers: 255 - key
  std::vector<std::size_t> mixed_;   // pixels of a row that show the plate and more
  std::vector<capture::Half> row_;   // the plate there, with alpha
  std::vector<std::uint8_t> codes_;  // of it
};

}  // namespace compositing
