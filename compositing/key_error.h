// How far a keyed frame is from the truth.
#pragma once

#include <array>

#include "capture/image.h"

namespace compositing {

// Errors of keyed frames, each a mean over pixels and frames added so far.
struct KeyError {
  double composite = 0;  // 100 x distance in Oklab over the new background, channels within 0..1
  double edge = 0;       // the same where true alpha is .02 to .98
  double alpha_mse = 0;
  double leak = 0;  // alpha where the truth is below .001
  double hole = 0;  // 1 - alpha where the truth is above .999
};

// Adds up over frames. Sizes must agree: std::invalid_argument.
class KeyErrorSum {
 public:
  // `keyed` and `truth` are (height, width, 4), scene-linear, premultiplied; `background`
  // (height, width, 3) is what they are put over.
  void add(const capture::Image& keyed,
           const capture::Image& truth,
           const capture::Image& background);
  KeyError mean() const;

 private:
  struct Sum {
    double sum = 0;
    double count = 0;
    void add(double value) { sum += value, count += 1; }
    double mean() const { return count > 0 ? sum / count : 0; }
  };
  Sum composite_, edge_, alpha_, leak_, hole_;
};

// How much alpha flickers where it should keep still: the standard deviation of each pixel over
// frames of a scene at rest, root mean square over pixels.
class AlphaFlicker {
 public:
  // A keyed frame, (height, width, 4). Throws std::invalid_argument if sizes change.
  void add(const capture::Image& keyed);
  double deviation() const;  // 0 for fewer than two frames

 private:
  int frames_ = 0;
  std::vector<double> sums_;
  std::vector<double> squares_;
};

// L, a, b of scene-linear Rec.709.
//
// Ottosson, "A perceptual color space for image processing", 2020.
std::array<float, 3> oklab_of(float r, float g, float b);

// What made clips are put over: a soft dusk, cool on the left and warm on the right. (height,
// width, 3), scene-linear.
capture::Image make_new_background(int height, int width);

}  // namespace compositing
