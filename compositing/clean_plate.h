// The screen without anybody before it, and how it is lit in the frame at hand.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "capture/colour.h"
#include "capture/image.h"
#include "capture/pool.h"
#include "compositing/gap_filler.h"
#include "compositing/key_lanes.h"
#include "compositing/screen_colour.h"
#include "compositing/screen_near.h"

namespace compositing {

// A frame as codes of 8 bits.
struct CodedFrame {
  int height = 0;
  int width = 0;
  std::span<const std::uint8_t> rgba;  // (height, width, 4); alpha is not read
  capture::Transfer transfer = capture::Transfer::srgb;
};

// Less than that is not measured.
inline constexpr float least_noise_floor = 1e-8F;

// Scene-linear, as the frames are.
struct CleanPlate {
  capture::Image light;  // (height, width, 3); finite, not negative
  ScreenColour colour = ScreenColour::green;
  // Of one frame's pixel: variance = gain * light + floor.
  float noise_gain = 1e-4F;
  float noise_floor = 1e-6F;
  bool knows_noise = false;  // measured, or told by a file; else it is a good camera's
  float known = 1;           // share of the frame in which the screen itself was seen
};

// The mean of frames of the empty screen, of one size, at least one. Noise is measured if there are
// two or more. Values that are not finite, or below 0, count as 0. The screen's colour is that of
// the mean (find_screen_colour) if none is given; it need not fill the picture. Throws
// std::invalid_argument if there are no frames, sizes differ, or a frame is not (height, width, 3).
CleanPlate average_plate(std::span<const capture::Image> frames,
                         std::optional<ScreenColour> colour = {});

// Takes the noise out of a screen's light, which is smooth, in place: mean over a box of 5x5
// pixels, cut at the borders. (height, width, 3).
void blur_screen(capture::Image& light);

// How much of a plate looks as its screen does, 0..1; 0 of a grey one. (height, width, 3), not
// empty. `garbage`: (height, width), 255 = does not count, or empty.
float screen_share(const capture::Image& light,
                   ScreenColour colour,
                   std::span<const std::uint8_t> garbage = {});

// The colour of a picture's mean. (height, width, 3), not empty.
ScreenColour mean_colour(const capture::Image& light);

// How the last value of a plate's cell is to be read.
enum class PlateUse : std::uint8_t {
  screen,      // 1 / excess of the screen's colour; 0 where there is no screen
  difference,  // 1 / noise of a pixel
};

// The plate as lit in one frame, on a grid of every step-th pixel: what keying needs of it. Cells
// of (first, second, third, see PlateUse), channels in the keyer's order.
struct LitPlate {
  int height = 0;  // of the frame
  int width = 0;
  int step = 4;  // 4 for screens, which are smooth; 1 for other backgrounds
  int rows = 0;
  int columns = 0;
  std::vector<float> cells;
  ScreenColour colour = ScreenColour::green;
  PlateUse use = PlateUse::screen;
  float sigma = 0;  // noise of the screen's share at a pixel of bare screen
  ScreenNear near;  // in that frame

  const float* cell(int row, int column) const {
    return &cells[4 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                       static_cast<std::size_t>(column))];
  }
};

// The plate at a pixel of the frame, bilinear between cells.
std::array<float, 4> plate_at(const LitPlate& plate, int y, int x);

// What following the light saw in a frame.
struct PlateSight {
  bool has_screen = false;  // whether the plate shows one
  float screen = 0;         // share of it that is in sight
  float gain = 1;           // mean of the frame's light over the plate's
  float mismatch = 0;  // how far the screen in sight is from the plate as lit, as a share of it
  float clipped = 0;   // share of the screen in sight whose primary is at display white
  float shadowed = 0;  // share of the plate's screen that is in sight with its colour, but with
                       // less than a fourth of its light
};

struct CellSums;

// Keeps a plate true under light that changes: by a gain on a grid of 8x8 pixels, from those cells
// whose colour is the plate's. Behind the person it is taken from around; where nothing is in sight
// from the frame before.
class PlateLight {
 public:
  static constexpr int cell = 8;

  // A screen's light is blurred; another background's is not, for it has edges, and its colour is
  // that of its mean. Throws std::invalid_argument for an empty plate.
  explicit PlateLight(CleanPlate plate, PlateUse use = PlateUse::screen);

  const CleanPlate& plate() const { return plate_; }
  const LitPlate& bare() const { return bare_; }  // without gain
  // Of colour, against the primary; of the gain within a cell: what noise may make of them.
  float tolerance() const { return tolerance_; }
  float spread() const { return spread_; }
  // LitPlate::sigma under a mean gain: noise of dim light is the larger part of the share.
  float sigma_under(float gain) const;
  const LitPlate& lit() const { return *lit_; }
  // The same, not touched by later updates while it is held.
  std::shared_ptr<const LitPlate> shared_lit() const { return lit_; }

  // Follows a frame; `follow` false: the plate as it was taken. Allocates nothing. Throws
  // std::invalid_argument naming both sizes if the frame's is not the plate's.
  PlateSight update(const capture::Image& frame, bool follow);
  PlateSight update(const CodedFrame& frame, bool follow);
  void check_size(int height, int width) const;
  // Throw the same.
  void check(const capture::Image& frame) const;
  void check(const CodedFrame& frame) const;

 private:
  template <class Rows>
  PlateSight update_from(const Rows& rows, bool follow);
  template <class Rows>
  PlateSight measure(const Rows& rows);
  template <class Rows>
  CellSums look_at(const Rows& rows, int row, int column) const;
  float know_background_alone();
  std::array<F8, 3> ratios_at(int y, int x) const;
  void prepare();
  void light_up();
  std::shared_ptr<LitPlate> renew();

  // Two cells of the gain that a column of the plate lies between.
  struct Between {
    int left, right;
    float share;  // of the right one
  };

  CleanPlate plate_;
  LitPlate bare_;  // without gain
  capture::Pool<LitPlate> plates_;
  std::shared_ptr<LitPlate> lit_;
  bool gained_ = false;          // whether it has a gain on it
  std::vector<float> ratios_;    // (1 / first, second / first, third / first, known), as its cells
  std::vector<float> pixels_;    // of each cell of the gain that are looked at, 0 = shows no screen
  std::vector<Between> across_;  // of each column of the plate
  int rows_apart_ = 2;           // of those that are looked at
  std::vector<float> gain_row_;
  std::vector<float> cell_gains_, over_gains_;  // of a row of the plate
  std::vector<float> gains_;                    // filled and smoothed
  std::vector<float> blurred_;
  GapFiller filler_;
  std::vector<float> shown_;  // of the gain's cells: 1 = shows the screen
  float tolerance_ = 0;       // of colour, against the primary
  float spread_ = 0;          // of the gain within a cell
  // Means over the screen: of light as noise weighs it, and of excess.
  float noisy_light_ = 0, excess_ = 0;
  float usual_gain_ = 1;  // of PlateUse::difference, in the frame before
  std::vector<float> known_gains_;
};

}  // namespace compositing
