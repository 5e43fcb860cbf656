// Latitude-longitude maps smoothed by reflection lobes, and shrunk.
#pragma once

#include <cstddef>
#include <vector>

#include "capture/image.h"

namespace render {

// A map (any height, twice as wide, 3 channels) averaged over the solid angles of the texels of a
// map of another height. Values are taken as counted_radiance() says.
capture::Image area_averaged(const capture::Image& map, int height);
// The same into an image that keeps its buffer.
void area_average(const capture::Image& map, int height, capture::Image& out);

// The lobe of a rough surface seen head-on, GGX's distribution of normals with parameter alpha
// (Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007), as a
// filter on latitude-longitude maps of one height.
//
// The lobe depends on the angle between two directions only, so that between any two rows the
// filter is a circular convolution, and a product after a Fourier transform along the rows. Rows
// mirrored at the horizon share their products: their sums and differences are filtered apart.
class LobeFilter {
 public:
  // Picks the height (32, 64 or 128) from the width of the lobe.
  explicit LobeFilter(double alpha);

  int height() const { return height_; }
  // Filters (height, 2 * height, 3) into `out` of the same size, without negative values.
  void apply(const capture::Image& map, capture::Image& out) const;

 private:
  std::size_t half() const { return static_cast<std::size_t>(height_) / 2; }
  void make_products(double alpha);

  int height_ = 0;
  std::size_t frequencies_ = 0;  // products beyond this frequency would be nothing
  // Per frequency, [from row][to row] of the upper half: for sums and for differences of mirrored
  // rows.
  std::vector<float> sums_, differences_;
};

// The filter of an alpha, made when it is first asked for, then kept. Safe from any thread.
const LobeFilter& shared_lobe_filter(float alpha);

}  // namespace render
