// Transport kept from frame to frame.
#include "render/kept_transport.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <iterator>
#include <utility>

#include "capture/parallel_loop.h"
#include "render/kernel.h"
#include "render/light_gather.h"
#include "render/trace.h"

namespace render {
namespace {

// How far away a box is, at the least and at the most.
std::array<float, 2> distances_to(const Scene::Bounds& box, Vec3f from) {
  const auto off = [](float lower, float upper, float at) {
    const float below = lower - at, above = at - upper;
    return std::array{std::max({below, above, 0.0F}), std::max(-below, -above)};
  };
  const auto x = off(box.lower.x, box.upper.x, from.x), y = off(box.lower.y, box.upper.y, from.y),
             z = off(box.lower.z, box.upper.z, from.z);
  return {length(Vec3f{x[0], y[0], z[0]}), length(Vec3f{x[1], y[1], z[1]})};
}

// Whether cells' shadow rays come to something else where things moved.
class ShadowTest {
 public:
  ShadowTest(const MovedThings& things, const LightTable& lights, const FrameContext& frame)
      : things_(things),
        lights_(lights),
        frame_(frame),
        moved_(things.where(), lights.lights.size(), frame.soft_lights) {}

  // Yes where that is not known.
  bool differs(const CellTransport& cell, int stage) const {
    if (!cell.shadow_answers.known() || !things_.shade_alone()) return true;
    prepare_thread();
    const Effort& effort = frame_.efforts[static_cast<std::size_t>(stage)];
    const LightContext context{.scene = frame_.inputs.scene,
                               .table = &lights_,
                               .effort = &effort,
                               .parts = effort.soft_lights ? &frame_.soft_lights : nullptr};
    std::unique_ptr<GatherWorkspace>& workspace = workspaces_.local();
    if (!workspace) workspace = std::make_unique<GatherWorkspace>();
    const LivePictures pictures =
        cell.past_pictures ? LivePictures::passed_apart : LivePictures::met;
    return cell.shadow_answers.differ(context, moved_, pictures, *workspace);
  }

 private:
  const MovedThings& things_;
  const LightTable& lights_;
  const FrameContext& frame_;
  MovedInLight moved_;
  mutable tbb::enumerable_thread_specific<std::unique_ptr<GatherWorkspace>> workspaces_;
};

}  // namespace

void KeptTransport::begin_frame(const FrameKeys& keys, const FrameContext& frame) {
  scarce_ = bytes_ > room() / 2;
  follow(keys, frame);
  if (bytes_ <= room() / 8 * 7) return;
  for (Cell& cell : cells_) {
    if (cell.transport) drop_answers(cell);
  }
}

// Pictures come before cells that stay where things move.
void KeptTransport::drop_answers(Cell& cell) {
  const std::size_t bytes = cell.transport->shadow_answers.bytes();
  cell.transport->shadow_answers = {};
  cell.bytes -= bytes, bytes_ -= bytes;
}

void KeptTransport::follow(const FrameKeys& keys, const FrameContext& frame) {
  const Scene& scene = *frame.inputs.scene;
  const bool same_size = frame.columns == columns_ && frame.rows == rows_;
  auto moved = Scene::moved(places_, scene.places());
  const bool same_transport = keys.transport == keys_.transport;
  light_stays_ = keys.light.all == keys_.light.all;
  keys_ = keys;
  const auto caustics_before = std::exchange(shown_caustics_, frame.caustics);
  const bool same_way = stalls_.empty() == frame.stalls.empty();
  const auto held = [&](const auto& boxes) {
    return std::ranges::all_of(boxes, [&](const auto& bounds) { return grid_.holds(bounds); });
  };
  if (same_transport && same_size && same_way && moved) {
    Changes changes;
    changes.stalls = PictureStalls::changed(stalls_, frame.stalls);
    if (moved->empty() && changes.stalls.empty()) return;
    if (grid_.is_laid()) {
      // In its outermost boxes the grid tells little. It is laid anew, and all is lost, as soon as
      // a move there loses nearly as much, or moves have lost as much again and again.
      const bool beyond = !held(*moved) || !held(changes.stalls);
      const std::size_t before = beyond ? count_kept() : 0;
      if (caustics_before && frame.caustics && caustics_before->key() != frame.caustics->key()) {
        changes.relit = caustics_before->regions();
        std::ranges::copy(frame.caustics->regions(), std::back_inserter(changes.relit));
      }
      changes.but_apart = *Scene::moved_but_apart(places_, scene.places());
      changes.moved = std::move(*moved);
      forget(std::move(changes), frame);
      const std::size_t lost = beyond ? before - count_kept() : 0;
      lost_beyond_ += lost;
      if (beyond && (4 * lost >= 3 * before || lost_beyond_ >= 2 * cells_.size())) {
        forget_all(scene);
      }
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
  stalls_ = frame.stalls;
  columns_ = frame.columns;
  rows_ = frame.rows;
  full_ = false;
}

std::size_t KeptTransport::count_kept() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(cells_, [](const Cell& cell) { return cell.stage != none; }));
}

void KeptTransport::forget_all(const Scene& scene) {
  for (Cell& cell : cells_) cell.stage = cell.needs_pictures = none;
  scratch_bytes_ = 0;
  bends_plate_ = false;
  cones_.clear();
  grid_ = SpaceGrid(scene.virtual_bounds());
  lost_beyond_ = 0;
}

void KeptTransport::forget(Changes changes, const FrameContext& frame) {
  // Most often pictures alone have changed, and no cell was found with any.
  const bool any_past =
      !changes.but_apart.empty() || !changes.stalls.empty() || !changes.relit.empty();
  const bool any_with = std::ranges::any_of(cells_, [](const Cell& cell) {
    return cell.stage != none && !cell.transport->past_pictures;
  });
  if (cones_.empty()) cones_ = cell_cones(*frame.inputs.directions, frame.turn);
  if (!any_past && !any_with) return;
  SpaceGrid::Mask receivers{};
  for (const Cell& cell : cells_) {
    if (cell.stage == none) continue;
    const SpaceGrid::Mask& lit = cell.transport->reach.lit.boxes;
    for (std::size_t i = 0; i < lit.size(); ++i) receivers[i] |= lit[i];
  }
  LightTable lights = *frame.planned_table;
  lights.lamps.resize(frame.job->lights.lamps.size());  // those of caustics are nowhere
  const auto things = [&](std::vector<Scene::Bounds> where) {
    return MovedThings(std::move(where), grid_, lights, frame.soft_lights, receivers,
                       changes.relit);
  };
  // Cells that were found without pictures stay while these stay in their stalls.
  const MovedThings but_apart = things(changes.but_apart), stalls = things(changes.stalls),
                    moved = things(changes.moved);
  const bool all_but_apart = changes.but_apart.size() == changes.moved.size();
  const ShadowTest but_apart_test(but_apart, lights, frame), moved_test(moved, lights, frame);
  capture::parallel_for(std::size_t{0}, cells_.size(), [&](std::size_t i) {
    Cell& cell = cells_[i];
    if (cell.stage == none) {
      cell.needs_pictures = none;
      return;
    }
    const CellTransport& transport = *cell.transport;
    const auto may_be_met = [&](const MovedThings& things) {
      return things.may_be_seen(cones_[i], frame.camera) || things.may_be_passed(transport.reach);
    };
    const auto matters = [&](const MovedThings& things, const ShadowTest& test) {
      return may_be_met(things) ||
             (things.may_light(transport.reach.lit) && test.differs(transport, cell.stage));
    };
    if (transport.past_pictures) {
      const bool changed = any_past && (matters(but_apart, but_apart_test) ||
                                        stalls_matter(changes.stalls, stalls, i, frame));
      if (changed) cell.stage = none;
      return;
    }
    const bool by_stalls =
        any_past && (may_be_met(stalls) || stalls.may_light(transport.reach.lit));
    if (!by_stalls && !matters(moved, moved_test)) return;
    const bool by_others =
        any_past && (by_stalls || all_but_apart || matters(but_apart, but_apart_test));
    cell.needs_pictures = by_others ? none : cell.stage;
    cell.stage = none;
  });
}

// Whether a cell that was found without pictures would be found otherwise with other stalls: where
// these may come between things that its camera rays see side by side, where bounced rays pass, and
// where points are lit of which nothing is kept.
bool KeptTransport::stalls_matter(const std::vector<Scene::Bounds>& boxes,
                                  const MovedThings& stalls,
                                  std::size_t i,
                                  const FrameContext& frame) const {
  const CellTransport& cell = *cells_[i].transport;
  const bool parts = std::ranges::any_of(boxes, [&](const Scene::Bounds& box) {
    const auto [nearest, farthest] = distances_to(box, frame.camera);
    constexpr float margin = 1e-4F;  // of distances along rays
    return cell.farthest_m > nearest * (1 - margin) &&
           (cell.nearest_m < farthest * (1 + margin) || !render::none(cell.looks_apart)) &&
           may_be_seen(cones_[i], frame.camera, box);
  });
  if (parts || stalls.may_be_passed(cell.reach)) return true;
  const bool knows_centres = (render::none(cell.receiving) || !cell.shadowed.empty()) &&
                             (cell.mirrored.empty() || !cell.mirrored_shadowed.empty());
  return stalls.may_light(knows_centres ? cell.reach.lit_apart : cell.reach.lit);
}

const CellReach* KeptTransport::reach_with_pictures(int column, int row, int stage) const {
  const Cell& cell = cells_[index(column, row)];
  return cell.needs_pictures == stage && cell.transport ? &cell.transport->reach : nullptr;
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

std::vector<float> KeptTransport::looks_ms() const {
  const auto threads = static_cast<float>(tbb::this_task_arena::max_concurrency());
  std::vector<float> looks;
  looks.reserve(cells_.size());
  for (const Cell& cell : cells_) looks.push_back(cell.times.look_ms / threads);
  return looks;
}

float KeptTransport::finding_ms() const {
  float all = 0;
  for (const Cell& cell : cells_) all += cell.times.find_ms;
  return all / static_cast<float>(tbb::this_task_arena::max_concurrency());
}

CellTransport* KeptTransport::place(int column, int row, int stage) {
  Cell& cell = cells_[index(column, row)];
  // What was forgotten keeps its room for what comes, unless others may need it: a cell begins
  // again coarse, and takes a hundredth of what it took in the end.
  const bool coarser = cell.stage > stage;
  if ((cell.stage == none && scarce_) || coarser) {
    const std::size_t replaced = coarser ? cell.bytes : 0;
    bytes_ -= cell.bytes;
    cell = {};
    cell.replaced = replaced;
  }
  if (coarser) full_ = false;
  // What is kept already stays as it is, rather than make room for the same in more detail.
  if (bytes_ >= room() && !coarser && (!cell.transport || cell.stage != none)) {
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
  if (others + bytes > room() / 4 * 3) drop_answers(cell);
  cell.stage = stage;
  cell.needs_pictures = none;
  if (cell.transport->bends_plate()) bends_plate_ = true;
  const bool less = cell.bytes <= std::exchange(cell.replaced, std::size_t{0});
  if (others + cell.bytes <= room() || less) return;
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
