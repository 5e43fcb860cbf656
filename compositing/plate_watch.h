// Whether a still camera stands where it stood when its clean plate was taken.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "capture/image.h"
#include "compositing/clean_plate.h"
#include "compositing/coarse_shift.h"

namespace compositing {

// How far a frame is shifted against its plate.
struct PlateShift {
  int patches = 0;     // of the plate that would show it; too few: it cannot be told
  int seen = 0;        // of those, in sight in this frame
  int agree = 0;       // of those, shifted alike
  bool known = false;  // enough of them, and agreed
  float right_px = 0;  // pixels of the frame, the median of those seen
  float down_px = 0;
  float sigma_px = 0;  // of either

  float size_px() const { return std::sqrt(right_px * right_px + down_px * down_px); }
};

// Follows a few patches of the plate in which shifts show: edges of the screen, folds, things
// beside it. A screen alone, evenly lit, tells nothing; nor do slopes of its light, which are
// light's.
//
// Each patch is found by least squares over shift, gain and offset, coarse to fine (Lucas and
// Kanade, "An Iterative Image Registration Technique", IJCAI 1981); persons before it, and what
// else has changed, are patches that do not fit. Where to look is chosen by the shift's own
// uncertainty. Where hardly any fits, they are looked for where the edges of the whole picture lie
// (CoarseShift), up to a quarter of it away.
class PlateWatch {
 public:
  // Throws std::invalid_argument for an empty plate.
  explicit PlateWatch(const CleanPlate& plate);

  // Frames of the plate's size. Allocates nothing.
  PlateShift look(const LightRows& frame) { return look_at(frame); }
  PlateShift look(const CodeRows& frame) { return look_at(frame); }

 private:
  static constexpr int side = 16;  // of a patch, in cells
  static constexpr int levels = 2;
  static constexpr float farthest = 5;  // cells

  // Light summed over channels, of squares of pixels.
  struct Grid {
    int rows = 0, columns = 0;
    std::vector<float> cells;
    float at(int row, int column) const {
      return cells[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                   static_cast<std::size_t>(column)];
    }
  };
  struct Patch {
    int row = 0, column = 0;  // of its first cell
    float sigma = 0;          // of its shift, in cells, by the noise
    float contrast = 0;       // standard deviation of its cells
  };
  struct Found {
    bool fits = false;
    float right = 0, down = 0;  // cells
  };

  // Cells by which the frame is shifted, about which it is looked for.
  struct About {
    int right = 0, down = 0;
    bool operator==(const About&) const = default;
  };

  template <class Rows>
  PlateShift look_at(const Rows& frame);
  template <class Rows>
  PlateShift follow(const Rows& frame, About about);
  template <class Rows>
  PlateShift look_afar(const Rows& frame);
  template <class Rows>
  void sample(const Rows& frame, const Patch& patch);
  // In what was sampled last.
  Found find(const Patch& patch) const;
  // One step of it on a level; false where it cannot be told.
  bool step(const Patch& patch, int level, float& right, float& down, float* misfit) const;
  float noise_of(float light) const;
  void choose_patches();

  int height_, width_;
  int pixels_;  // along a cell
  float noise_gain_, noise_floor_;
  std::array<Grid, levels> plate_;
  std::vector<Patch> patches_;
  std::optional<CoarseShift> afar_;  // none of pictures that are smaller than its cells
  std::vector<float> seen_afar_;     // light of its cells
  About about_;                      // where it was seen last, if that is far away
  std::array<std::array<float, side * side>, levels> seen_{};  // of the patch at hand
  std::vector<float> rights_, downs_, middle_;
};

}  // namespace compositing
