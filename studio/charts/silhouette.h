// How far a shown person is from the true one.
#pragma once

#include "capture/image.h"

namespace studio {

struct PersonError {
  // 100 x distance in Oklab of the composites, channels within 0..1: mean over the pixels in which
  // either person is.
  double composite = 0;
  double silhouette_px = 0;  // mean distance from either silhouette to the other; 0 if one is empty
  double wrong_share = 0;  // pixels that are wrongly the person's or not, in those of the true one
};

// `shown` is (height, width, 4): finished picture and coverage; `truth` (height, width, 4) the true
// person, premultiplied, over `plate` (height, width, 3). A silhouette is where alpha passes a
// half. Throws std::invalid_argument for sizes that differ.
PersonError person_error(const capture::Image& shown,
                         const capture::Image& truth,
                         const capture::Image& plate);

}  // namespace studio
