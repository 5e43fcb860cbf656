// Transport kept from frame to frame.
#include "render/kept_transport.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "render/kernel.h"

namespace render {

void KeptTransport::begin_frame(const FrameKeys& keys, const FrameContext& frame) {
  const Scene& scene = *frame.inputs.scene;
  const bool same_size = frame.columns == columns_ && frame.rows == rows_;
  auto moved = Scene::moved(places_, scene.places());
  const bool same_transport = keys.transport == keys_.transport;
  light_stays_ = keys.light.all == keys_.light.all;
  scarce_ = bytes_ > room() / 2;
  keys_ = keys;
  const auto caustics_before = std::exchange(shown_caustics_, frame.caustics);
  if (same_transport && same_size && moved) {
    if (moved->empty()) return;
    if (std::ranges::all_of(*moved, [&](const auto& bounds) { return grid_.holds(bounds); })) {
      std::vector<Scene::Bounds> relit;
      if (caustics_before && frame.caustics && caustics_before->key() != frame.caustics->key()) {
        relit = caustics_before->regions();
        std::ranges::copy(frame.caustics->regions(), std::back_inserter(relit));
      }
      forget(std::move(*moved), std::move(relit), frame);
    } else {
      forget_all(scene);
    }
  } else {
    if (!same_size) {
      cells_.clear();
      cells_.resize(static_cast<std::size_t>(frame.columns) * static_cast<std::size_t>(frame.rows));
      bytes_ = 0;
      max_bytes_ = max_bytes(cells_.size());
    }
    forget_all(scene);
  }
  places_ = scene.places();
  columns_ = frame.columns;
  rows_ = frame.rows;
  full_ = false;
}

void KeptTransport::forget_all(const Scene& scene) {
  for (Cell& cell : cells_) cell.stage = none;
  scratch_bytes_ = 0;
  bends_plate_ = false;
  cones_.clear();
  grid_ = SpaceGrid(scene.virtual_bounds());
}

void KeptTransport::forget(std::vector<Scene::Bounds> moved,
                           std::vector<Scene::Bounds> relit,
                           const FrameContext& frame) {
  if (cones_.empty()) cones_ = cell_cones(*frame.inputs.directions, frame.turn);
  SpaceGrid::Mask receivers{};
  for (const Cell& cell : cells_) {
    if (cell.stage == none) continue;
    const SpaceGrid::Mask& lit = cell.transport->reach.lit;
    for (std::size_t i = 0; i < lit.size(); ++i) receivers[i] |= lit[i];
  }
  LightTable lights = *frame.planned_table;
  lights.lamps.resize(frame.job->lights.lamps.size());  // those of caustics are nowhere
  const MovedThings things(std::move(moved), grid_, lights, frame.soft_lights, receivers,
                           std::move(relit));
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    Cell& cell = cells_[i];
    if (cell.stage == none) continue;
    if (things.may_be_seen(cones_[i], frame.camera) || things.may_change(cell.transport->reach)) {
      cell.stage = none;
    }
  }
}

const CellTransport* KeptTransport::find(int column, int row, int stage) const {
  const Cell& cell = cells_[index(column, row)];
  return cell.stage == stage ? cell.transport.get() : nullptr;
}

std::vector<int> KeptTransport::stages() const {
  std::vector<int> stages;
  stages.reserve(cells_.size());
  for (const Cell& cell : cells_) stages.push_back(cell.stage);
  return stages;
}

CellTransport* KeptTransport::place(int column, int row) {
  Cell& cell = cells_[index(column, row)];
  // What was forgotten keeps its room for what comes, unless others may need it: a cell begins
  // again coarse, and takes a hundredth of what it took in the end.
  if (cell.stage == none && scarce_) {
    bytes_ -= cell.bytes;
    cell = {};
  }
  // What is kept already stays as it is, rather than make room for the same in more detail.
  if (bytes_ >= room() && (!cell.transport || cell.stage != none)) {
    full_ = true;
    return nullptr;
  }
  if (!cell.transport) cell.transport = std::make_unique<CellTransport>();
  return cell.transport.get();
}

void KeptTransport::found_with(std::size_t scratch_bytes) {
  const auto threads = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  const std::size_t all = scratch_bytes * threads;
  std::size_t before = scratch_bytes_;
  while (before < all && !scratch_bytes_.compare_exchange_weak(before, all)) {
  }
}

void KeptTransport::keep(int column, int row, int stage) {
  Cell& cell = cells_[index(column, row)];
  cell.lit.reset();
  const std::size_t bytes = cell.transport->bytes();
  const std::size_t others = bytes_.fetch_add(bytes - cell.bytes) - cell.bytes;
  cell.bytes = bytes;
  cell.stage = stage;
  if (!cell.transport->bent.empty()) bends_plate_ = true;
  if (others + bytes <= room()) return;
  // Too much: this cell's is given back.
  full_ = true;
  bytes_ -= cell.bytes;
  cell = {};
}

LitCell* KeptTransport::place_lit(int column, int row) {
  Cell& cell = cells_[index(column, row)];
  if (!light_stays_ || cell.stage == none) return nullptr;
  if (!cell.lit) {
    if (bytes_ + sizeof(LitCell) > room()) return nullptr;
    cell.lit = std::make_unique<LitCell>();
    cell.bytes += sizeof(LitCell);
    bytes_ += sizeof(LitCell);
  }
  return cell.lit.get();
}

}  // namespace render
