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

// How a frame's picture lies against its plate's: larger and turned about its middle, and shifted.
struct PlateShift {
  int patches = 0;     // of the plate that would show it; too few: it cannot be told
  int seen = 0;        // of those, in sight in this frame
  int agree = 0;       // of those, moved alike
  bool known = false;  // enough of them, and agreed
  // Many are in sight and most of them elsewhere, but not as a camera's picture moves: a plate of
  // another set-up, or all that stands around has been moved.
  bool scattered = false;
  float right_px = 0;  // pixels of the frame, of the middle of the picture
  float down_px = 0;
  float sigma_px = 0;     // of either
  float roll_rad = 0;     // of the picture, clockwise; 0 where none shows
  float scale = 1;        // of the frame's picture over the plate's; 1 where none shows
  float farthest_px = 0;  // how far the corner of the picture has gone that has gone farthest
  float farthest_sigma_px = 0;

  float size_px() const { return std::sqrt(right_px * right_px + down_px * down_px); }
  bool is_turned() const { return roll_rad != 0 || scale != 1; }
};

// Follows a few patches of the plate in which shifts show: edges of the screen, folds, things
// beside it. A screen alone, evenly lit, tells nothing; nor do slopes of its light, which are
// light's.
//
// Each patch is found by least squares over shift, gain and offset, coarse to fine (Lucas and
// Kanade, "An Iterative Image Registration Technique", IJCAI 1981); persons before it, and what
// else has changed, are patches that do not fit. Where to look is chosen by the shift's own
// uncertainty. What most patches agree on is a shift, or a similarity where that is clearly better:
// the best one of pairs of patches, then least squares (Fischler and Bolles, "Random Sample
// Consensus", CACM 1981, but of all pairs; costs as Torr and Zisserman's MSAC, CVIU 2000).
//
// Where hardly any fits, they are looked for where the edges of the whole picture lie
// (CoarseShift), up to a quarter of it away, and in pictures that are turned by up to six degrees,
// or larger or smaller by up to a third, as another lens shows them.
class PlateWatch {
 public:
  // Throws std::invalid_argument for an empty plate.
  explicit PlateWatch(const CleanPlate& plate);

  // Frames of the plate's size, in order. Allocates nothing.
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
    float right = 0, down = 0;  // cells of the level
  };

  // Where a place of the plate lies in the frame, both from the middle of the picture, in cells:
  // (1 + a, -b; b, 1 + a) times the place, and the shift.
  struct Motion {
    float a = 0, b = 0, right = 0, down = 0;
    bool operator==(const Motion&) const = default;
  };
  // A place of the plate, and how far from it it is seen; both in cells.
  struct Pair {
    float x = 0, y = 0, right = 0, down = 0;
  };
  // What pairs say together.
  struct Consensus {
    Motion motion;
    float cost = 0;  // squares of what is left, each no more than that of one that does not agree
    int agree = 0;
    float sigma = 0;   // of the shift
    float spread = 0;  // of the places, of those that agree: root of the sum of squares
  };

  template <class Rows>
  PlateShift look_at(const Rows& frame);
  template <class Rows>
  PlateShift follow(const Rows& frame, const Motion& about);
  template <class Rows>
  PlateShift follow_closely(const Rows& frame, const Motion& about);
  template <class Rows>
  PlateShift look_afar(const Rows& frame);
  template <class Rows>
  PlateShift look_turned(const Rows& frame);
  Consensus agree_on_shift();
  Consensus agree_on_similarity() const;
  Consensus refined(Motion motion) const;
  float cost_of(const Motion& motion, float enough) const;
  bool is_clearly_better(const Consensus& similarity, const Consensus& shift) const;
  Motion motion_of(const PlateShift& shift) const;
  float farthest_of(const Motion& motion) const;
  template <class Rows>
  void sample(const Rows& frame, const Patch& patch);
  // In what was sampled last. `x`, `y`: of the plate, where the patch's middle is thought to be.
  Found find(const Patch& patch, const Motion& about, float x, float y) const;
  // One step of it on a level; false where it cannot be told.
  bool step(const Motion& about, int level, float x, float y, Found& found, float* misfit) const;
  float noise_of(float light) const;
  // Of the plate, about, where the patch is.
  float mean_of(const Patch& patch) const {
    return plate_[0].at(patch.row + side / 2, patch.column + side / 2);
  }
  void choose_patches();

  int height_, width_;
  int pixels_;  // along a cell
  float noise_gain_, noise_floor_;
  std::array<Grid, levels> plate_;
  std::vector<Patch> patches_;
  std::optional<CoarseShift> afar_;  // none of pictures that are smaller than its cells
  std::vector<float> seen_afar_;     // light of its cells
  Motion about_;                     // about which it was found last, if that is elsewhere
  Motion found_about_;               // the same of what was looked for anywhere
  bool is_near_ = false;             // nothing fitted better anywhere than near its place
  int looks_ = 0;                    // so far, as far as it matters
  std::size_t next_turn_ = 0;        // that is looked for
  std::array<std::array<float, side * side>, levels> seen_{};  // of the patch at hand
  std::vector<Pair> pairs_;
  std::vector<float> middle_;
};

}  // namespace compositing
