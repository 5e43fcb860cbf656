// Which codes two shots of a bracket give the same places.
#pragma once

#include <vector>

#include "capture/response.h"

namespace capture {

// Flat places that have `code_a` in shot a have `code_b` in shot b, in the mean, to within `sigma`
// codes. One of the two is a whole code.
struct CodeMatch {
  int a = 0;  // index of the shot with the longer exposure
  int b = 0;
  int channel = 0;
  double code_a = 0;
  double code_b = 0;
  double sigma_a = 0;
  double sigma_b = 0;
  double pixels = 0;  // behind it
};

// Codes of a channel that fall although light grows, so that they stand for two lights.
struct CodeFall {
  int channel = 0;
  double from = 0;  // the higher code
  double to = 0;    // the lower code, which has more light
};

struct CodeComparison {
  std::vector<CodeMatch> matches;
  std::vector<CodeFall> falls;  // the deepest of each channel; none if codes rise with light
};

// The matches between each shot and the next two shorter ones. Codes near both ends, which clipping
// bends, are left out; what moved lies far from the mode of its code and is left out as well.
//
// Mann, "Comparametric Equations with Practical Applications in Quantigraphic Image Processing",
// IEEE Transactions on Image Processing 9(8), 2000: the joint histogram holds all that a pair of
// shots says about the response.
CodeComparison match_codes(std::span<const CodedShot> shots);

}  // namespace capture
