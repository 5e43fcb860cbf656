// Connected parts of a matte, and how far from them its pixels lie.
#pragma once

#include <cstddef>
#include <vector>

namespace compositing {

// A number for each pixel, row by row from the top.
template <class T>
struct Grid {
  int height = 0, width = 0;
  std::vector<T> of;

  T& at(int y, int x) { return of[index(y, x)]; }
  T at(int y, int x) const { return of[index(y, x)]; }
  std::size_t index(int y, int x) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  }
};
using Field = Grid<float>;

// Pixels of a row beside each other, both ends included.
struct PixelRun {
  int y, left, right;
};

// All runs of one connected thing, row by row; the box is the tightest, edges included.
struct Part {
  int left = 0, top = 0, right = 0, bottom = 0;
  std::size_t area = 0;
  std::vector<PixelRun> runs;
};

// The parts, connected by sides or corners, of what is at least `level`, in the order of their
// first pixels.
//
// By runs, joined from row to row: He, Chao and Suzuki, "A run-based two-scan labeling algorithm",
// IEEE Transactions on Image Processing 17, 2008.
std::vector<Part> parts_of(const Field& field, float level);

// The one of most pixels, the first of several; none if there are no parts.
const Part* largest(const std::vector<Part>& parts);

// 1 where the part is, else 0.
Field only(const Part& part, int height, int width);

// Distance to the nearest pixel of `field` that is `of`, in thirds of a pixel; 3 millions where
// there is none. Beyond the field is nothing, so that what its edges cut does not get thinner
// there.
//
// Chamfers of 3 and 4: Borgefors, "Distance Transformations in Digital Images", CVGIP 34, 1986,
// section 3.
Grid<int> thirds_to(const Field& field, float of);

}  // namespace compositing
