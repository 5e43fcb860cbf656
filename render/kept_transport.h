// The cells' transport, kept from frame to frame while nothing moves there: a pure cache.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "capture/half.h"
#include "render/bordered_levels.h"
#include "render/caustics.h"
#include "render/cell_transport.h"
#include "render/picture_stalls.h"
#include "render/plate_levels.h"

namespace render {

struct FrameContext;

// A cell as it was lit last, and by what.
struct LitCell {
  std::uint64_t light = 0, plate_levels = 0;  // FrameKeys
  bool shows_plate = true;                    // its own pixels' one, anywhere
  std::array<capture::Half, cell_pixels * 3> plate;
  std::array<capture::Half, cell_pixels * 4> rgba;
  std::array<capture::Half, cell_pixels> matte;
  RenderStatistics statistics;  // of lighting it
};

// A number that differs where what it stands for does. Of much data a part is looked at first: in a
// live show that has changed already, and stands for all.
struct DataKey {
  std::uint64_t glance = 0, all = 0;
};
struct FrameKeys {
  std::uint64_t transport = 0;  // all that cells' transport depends on, but things that move
  DataKey light;                // what lights it, but live textures and the plate
  DataKey plate_levels;         // the plate as clear bodies and mirrors show it
};

// While camera, lens, light directions and effort stay, a frame under other light takes no ray; and
// where things move, only those cells do whose rays may meet them. A cell whose light and plate did
// not change either is shown again as it is. A frame rendered with it has the same bits as one
// rendered without.
//
// One thread calls begin_frame; then many threads use cells, each cell by one thread at a time.
class KeptTransport {
 public:
  // Forgets what another transport's key has left behind, and cells that what moved may have
  // changed.
  void begin_frame(const FrameKeys& keys, const FrameContext& frame);

  // A cell's transport at a stage, or null if it is not kept.
  const CellTransport* find(int column, int row, int stage) const;
  // Of a cell that is not kept, but is known to be one that has to be found with live pictures:
  // what that depends on. Else null.
  const CellReach* reach_with_pictures(int column, int row, int stage) const;
  // Where to put it, or null if the memory is used up, unless it is coarser than what is kept;
  // keep() makes it count.
  CellTransport* place(int column, int row, int stage);
  void keep(int column, int row, int stage);

  // A kept cell as it was lit last: valid where find() finds it, `light` is the frame's, and so are
  // `plate_levels` and `plate` where it shows them. Null if it was not kept lit.
  const LitCell* lit(int column, int row) const { return cells_[index(column, row)].lit.get(); }
  // Where to keep it lit; null while the light changes from frame to frame, which makes it useless,
  // where the cell is not kept, or if the memory is used up.
  LitCell* place_lit(int column, int row);
  const FrameKeys& keys() const { return keys_; }
  // Whether any cell was kept that shows the plate in clear bodies or mirrors.
  bool bends_plate() const { return bends_plate_; }

  // Of all cells, row by row: the stage that they are kept at, or `none`.
  static constexpr int none = -1;
  std::vector<int> stages() const;

  // What finding a cell, and looking at live pictures in it, took on its thread.
  struct CellTimes {
    float find_ms = 0, look_ms = 0;
  };
  // Told by who renders it, in each frame.
  void took(int column, int row, const CellTimes& times) {
    cells_[index(column, row)].times = times;
  }
  // Of the last frame's time, which all threads share: that of looking, of all cells, row by row,
  // and that of finding together.
  std::vector<float> looks_ms() const;
  float finding_ms() const;

  CausticFollower& caustics() { return caustics_; }
  // Of each frame in turn.
  const std::shared_ptr<BorderedLevels>& bordered_levels() const { return bordered_levels_; }
  const std::shared_ptr<PlateLevels>& plate_levels() const { return plate_levels_; }

  // Of all cells, row by row, once anything has moved before a camera that stays; else empty.
  const std::vector<CellCone>& cones() const { return cones_; }

  // What cells mark where they reach in; stays while any cell is kept.
  const SpaceGrid& grid() const { return grid_; }

  // What finding a cell took on one thread: kept cells leave room for as much on all threads.
  void found_with(std::size_t scratch_bytes);

  // Of so many cells: half a kilobyte a pixel, but at least 128 and at most 512 MB. Kept cells have
  // what finding them leaves of it.
  static constexpr std::size_t max_bytes(std::size_t cells) {
    return std::clamp(cells * cell_pixels * 512, std::size_t{128} << 20, std::size_t{512} << 20);
  }
  // For kept cells: many threads leave them half.
  std::size_t room() const {
    return max_bytes_ - std::min<std::size_t>(scratch_bytes_, max_bytes_ / 2);
  }
  // Taken so far.
  std::size_t bytes() const { return bytes_; }
  // Whether a cell could not be kept, of late.
  bool is_full() const { return full_; }

 private:
  struct Cell {
    std::unique_ptr<CellTransport> transport;
    std::unique_ptr<LitCell> lit;  // of that transport
    std::size_t bytes = 0;         // counted in bytes_
    int stage = none;
    CellTimes times;            // in the last frame
    std::size_t replaced = 0;   // bytes of a finer one in whose place it is
    int needs_pictures = none;  // the stage at which it was last found with them, for it had to be
  };
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  void follow(const FrameKeys& keys, const FrameContext& frame);
  void drop_answers(Cell& cell);
  std::size_t count_kept() const;  // cells
  void forget_all(const Scene& scene);
  // What moved, where light falls otherwise, and what of that shows no picture apart; where
  // pictures have other stalls.
  struct Changes {
    std::vector<Scene::Bounds> moved, relit, but_apart, stalls;
  };
  void forget(Changes changes, const FrameContext& frame);
  bool stalls_matter(const std::vector<Scene::Bounds>& boxes,
                     const MovedThings& stalls,
                     std::size_t i,
                     const FrameContext& frame) const;

  CausticFollower caustics_;
  std::shared_ptr<BorderedLevels> bordered_levels_ = std::make_shared<BorderedLevels>();
  std::shared_ptr<PlateLevels> plate_levels_ = std::make_shared<PlateLevels>();
  std::shared_ptr<const Caustics> shown_caustics_;  // of the frame before
  FrameKeys keys_;
  bool light_stays_ = false;  // the same as in the frame before
  Scene::Places places_;
  PictureStalls stalls_;
  SpaceGrid grid_;
  std::size_t lost_beyond_ = 0;  // cells, by moves in its outermost boxes
  int columns_ = 0, rows_ = 0;
  std::vector<Cell> cells_;
  std::size_t max_bytes_ = 0;
  std::atomic<std::size_t> scratch_bytes_ = 0;  // of all threads
  std::vector<CellCone> cones_;                 // once anything has moved
  std::atomic<std::size_t> bytes_ = 0;
  std::atomic<bool> full_ = false, bends_plate_ = false;
  bool scarce_ = false;  // when the frame began, half of the room was taken
};

}  // namespace render
