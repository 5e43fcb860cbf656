// The cells' transport, kept from frame to frame while nothing moves: a pure cache.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "render/cell_transport.h"

namespace render {

// While scene, camera, lens, light directions and effort stay, a frame under other light takes no
// ray. A frame rendered with it has the same bits as one rendered without.
//
// One thread calls begin_frame; then many threads use cells, each cell by one thread at a time.
class KeptTransport {
 public:
  // Forgets what another key has left behind.
  void begin_frame(std::uint64_t key, int columns, int rows);

  // A cell's transport, or null if nothing is kept for it.
  const CellTransport* find(int column, int row) const;
  // Where to put it, or null if the memory is used up; keep() makes it count.
  CellTransport* place(int column, int row);
  void keep(int column, int row);

  static constexpr std::size_t max_bytes = std::size_t{512} << 20;
  // Taken so far.
  std::size_t bytes() const { return bytes_; }

 private:
  struct Cell {
    std::unique_ptr<CellTransport> transport;
    std::size_t bytes = 0;  // counted in bytes_
    bool kept = false;
  };
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  std::uint64_t key_ = 0;
  int columns_ = 0, rows_ = 0;
  std::vector<Cell> cells_;
  std::atomic<std::size_t> bytes_ = 0;
};

}  // namespace render
