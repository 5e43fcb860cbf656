// Visibility kept from frame to frame.
#include "render/kept_visibility.h"

namespace render {

void KeptVisibility::begin_frame(std::uint64_t key,
                                 int columns,
                                 int rows,
                                 std::size_t masks_per_cell) {
  const std::size_t cells = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  const bool fits = masks_per_cell > 0 && cells * masks_per_cell <= max_bytes / sizeof(CellMask);
  const std::size_t masks = fits ? cells * masks_per_cell : 0;
  if (key == key_ && columns == columns_ && rows == rows_ && masks_per_cell == masks_per_cell_)
    return;
  key_ = key;
  columns_ = columns;
  rows_ = rows;
  masks_per_cell_ = masks_per_cell;
  masks_.resize(masks);
  kept_.assign(fits ? cells : 0, 0);
}

const CellMask* KeptVisibility::find(int column, int row) const {
  const std::size_t cell = index(column, row);
  return cell < kept_.size() && kept_[cell] ? &masks_[cell * masks_per_cell_] : nullptr;
}

CellMask* KeptVisibility::place(int column, int row) {
  const std::size_t cell = index(column, row);
  return cell < kept_.size() ? &masks_[cell * masks_per_cell_] : nullptr;
}

void KeptVisibility::keep(int column, int row) { kept_[index(column, row)] = 1; }

}  // namespace render
