// The cells' transport, kept from frame to frame while nothing moves there: a pure cache.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "render/cell_transport.h"

namespace render {

struct FrameContext;

// While camera, lens, light directions and effort stay, a frame under other light takes no ray; and
// where things move, only those cells do whose rays may meet them. A frame rendered with it has the
// same bits as one rendered without.
//
// One thread calls begin_frame; then many threads use cells, each cell by one thread at a time.
class KeptTransport {
 public:
  // Forgets what another key has left behind, and cells that what moved may have changed.
  void begin_frame(std::uint64_t key, const FrameContext& frame);

  // A cell's transport at a stage, or null if it is not kept.
  const CellTransport* find(int column, int row, int stage) const;
  // Where to put it, or null if the memory is used up; keep() makes it count.
  CellTransport* place(int column, int row);
  void keep(int column, int row, int stage);

  // Of all cells, row by row: the stage that they are kept at, or `none`.
  static constexpr int none = -1;
  std::vector<int> stages() const;

  // What cells mark where they reach in; stays while any cell is kept.
  const SpaceGrid& grid() const { return grid_; }

  static constexpr std::size_t max_bytes = std::size_t{512} << 20;
  // Taken so far.
  std::size_t bytes() const { return bytes_; }
  // Whether a cell could not be kept, of late.
  bool is_full() const { return full_; }

 private:
  struct Cell {
    std::unique_ptr<CellTransport> transport;
    std::size_t bytes = 0;  // counted in bytes_
    int stage = none;
  };
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  void forget_all(const Scene& scene);
  void forget(std::vector<Scene::Bounds> moved, const FrameContext& frame);

  std::uint64_t key_ = 0;
  Scene::Places places_;
  SpaceGrid grid_;
  int columns_ = 0, rows_ = 0;
  std::vector<Cell> cells_;
  std::vector<CellCone> cones_;  // once anything has moved
  std::atomic<std::size_t> bytes_ = 0;
  std::atomic<bool> full_ = false;
};

}  // namespace render
