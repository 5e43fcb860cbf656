// Which pixels see which light, kept from frame to frame while nothing moves: a pure cache.
#pragma once

#include <cstdint>
#include <vector>

#include "render/light_gather.h"

namespace render {

// Visibility depends on the scene, the camera, the lights' directions and the effort, not on the
// lights' energies: while those stay, shadow rays of camera rays' hits need not be shot again. A
// frame rendered with a kept visibility has the same bits as one rendered without.
//
// One thread calls begin_frame; then many threads use cells, each cell by one thread at a time.
class KeptVisibility {
 public:
  // Forgets what another scene, camera, light directions or effort has left behind. Takes memory
  // for the masks of all cells, or keeps nothing if that were more than max_bytes.
  void begin_frame(std::uint64_t key, int columns, int rows, std::size_t masks_per_cell);

  // The masks of a cell (see CellMemory), or null if nothing is kept for it.
  const CellMask* find(int column, int row) const;
  // Where to put them, or null; keep() makes them count.
  CellMask* place(int column, int row);
  void keep(int column, int row);

  static constexpr std::size_t max_bytes = std::size_t{256} << 20;

 private:
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  std::uint64_t key_ = 0;
  int columns_ = 0, rows_ = 0;
  std::size_t masks_per_cell_ = 0;
  std::vector<CellMask> masks_;
  std::vector<std::uint8_t> kept_;
};

}  // namespace render
