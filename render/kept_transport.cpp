// Transport kept from frame to frame.
#include "render/kept_transport.h"

namespace render {

void KeptTransport::begin_frame(std::uint64_t key, int columns, int rows) {
  if (key == key_ && columns == columns_ && rows == rows_) return;
  if (columns != columns_ || rows != rows_) {
    cells_.clear();
    cells_.resize(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    bytes_ = 0;
  }
  key_ = key;
  columns_ = columns;
  rows_ = rows;
  for (Cell& cell : cells_) cell.kept = false;
}

const CellTransport* KeptTransport::find(int column, int row) const {
  const Cell& cell = cells_[index(column, row)];
  return cell.kept ? cell.transport.get() : nullptr;
}

CellTransport* KeptTransport::place(int column, int row) {
  Cell& cell = cells_[index(column, row)];
  if (!cell.transport) {
    if (bytes_ >= max_bytes) return nullptr;
    cell.transport = std::make_unique<CellTransport>();
  }
  return cell.transport.get();
}

void KeptTransport::keep(int column, int row) {
  Cell& cell = cells_[index(column, row)];
  const std::size_t bytes = cell.transport->bytes();
  const std::size_t before = bytes_.fetch_add(bytes - cell.bytes);
  cell.bytes = bytes;
  cell.kept = true;
  if (before + bytes <= max_bytes) return;
  // Too much: this cell's is given back.
  bytes_ -= cell.bytes;
  cell = {};
}

}  // namespace render
