// Cells of 16x16 pixels: transport, light, and the finished halves.
#include "render/kernel.h"

#include <algorithm>
#include <cmath>

#include "render/cell_baker.h"
#include "render/kept_transport.h"
#include "render/stand_in_parameters.h"
#include "render/trace.h"

namespace render {

struct TileWorkspace::Impl {
  CellBaker baker;
  CellTransport transport;
  RelightWorkspace relight;
  CellPicture picture;
  std::array<Vec3f, cell_pixels> plate;

  void render_cell(
      const FrameContext& frame, const TileJob& tile, int x0, int y0, TileResult& result);
  void load_plate(const TileJob& tile, int x0, int y0);
  void light(const FrameContext& frame, const CellTransport& cell, RenderStatistics& statistics);
  void write(
      const FrameContext& frame, const TileJob& tile, int x0, int y0, TileResult& result) const;
  static void write_counts(
      const CellTransport& cell, const TileJob& tile, int x0, int y0, TileResult& result);
};

TileWorkspace::TileWorkspace() : impl_(std::make_unique<Impl>()) {}
TileWorkspace::~TileWorkspace() = default;
TileWorkspace::TileWorkspace(TileWorkspace&&) noexcept = default;
TileWorkspace& TileWorkspace::operator=(TileWorkspace&&) noexcept = default;

void TileWorkspace::log_rays(RayLog* log) { impl_->baker.log_rays(log); }

void TileWorkspace::Impl::load_plate(const TileJob& tile, int x0, int y0) {
  const Rect& b = tile.background_rect;
  for (int y = 0; y < cell_size; ++y) {
    for (int x = 0; x < cell_size; ++x) {
      const int row = y0 + y - b.y, column = x0 + x - b.x;
      Vec3f& to = plate[static_cast<std::size_t>(y * cell_size + x)];
      if (row >= b.height || column >= b.width) {
        to = {};
        continue;
      }
      const std::size_t at = (static_cast<std::size_t>(row) * static_cast<std::size_t>(b.width) +
                              static_cast<std::size_t>(column)) *
                             3;
      to = {capture::float_from_half(tile.background[at]),
            capture::float_from_half(tile.background[at + 1]),
            capture::float_from_half(tile.background[at + 2])};
    }
  }
}

void TileWorkspace::Impl::light(const FrameContext& frame,
                                const CellTransport& cell,
                                RenderStatistics& statistics) {
  if (cell.empty) {
    picture.added.fill({});
    picture.share.fill({1, 1, 1});
    picture.passed.fill(1);
    picture.seen.fill(1);
    return;
  }
  render::relight(cell, {frame.job->lights.lights, frame.job->lights.lamps, frame.levels}, plate,
                  relight, picture, statistics);
}

void TileWorkspace::Impl::write(
    const FrameContext& frame, const TileJob& tile, int x0, int y0, TileResult& result) const {
  const Rect& rect = tile.rect;
  const calibrate::DirectionTable& directions = *frame.inputs.directions;
  RenderStatistics& statistics = result.statistics;
  const auto finish = [&statistics](float value) {
    if (std::abs(value) <= capture::half_max) return value;
    ++statistics.clamped_values;
    return std::isnan(value) ? 0.0F : std::clamp(value, -capture::half_max, capture::half_max);
  };
  for (int y = 0; y < cell_size; ++y) {
    for (int x = 0; x < cell_size; ++x) {
      const int row = y0 + y - rect.y, column = x0 + x - rect.x;
      if (row < 0 || column < 0 || row >= rect.height || column >= rect.width) continue;
      const auto k = static_cast<std::size_t>(y * cell_size + x);
      const float sensitivity = directions.sensitivity.empty()
                                    ? 1.0F
                                    : directions.sensitivity[directions.index(y0 + y, x0 + x)];
      const Vec3f rgb = with_light(plate[k] * picture.share[k], picture.added[k] * sensitivity);
      const float coverage = 1 - picture.seen[k], matte = 1 - picture.passed[k];
      const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(rect.width) +
                             static_cast<std::size_t>(column);
      result.rgba[at * 4] = capture::half_from_float(finish(rgb.x));
      result.rgba[at * 4 + 1] = capture::half_from_float(finish(rgb.y));
      result.rgba[at * 4 + 2] = capture::half_from_float(finish(rgb.z));
      result.rgba[at * 4 + 3] = capture::half_from_float(finish(coverage));
      result.matte[at] = capture::half_from_float(finish(matte));
      statistics.virtual_pixels += coverage > 0;
      statistics.affected_pixels += coverage > 0 || matte != 0 || picture.added[k] != Vec3f{};
    }
  }
}

void TileWorkspace::Impl::write_counts(
    const CellTransport& cell, const TileJob& tile, int x0, int y0, TileResult& result) {
  const Rect& rect = tile.rect;
  const int columns = std::min(cell_size, rect.x + rect.width - x0);
  const int rows = std::min(cell_size, rect.y + rect.height - y0);
  for (int y = 0; y < rows; ++y) {
    const auto to = static_cast<std::ptrdiff_t>(y0 + y - rect.y) * rect.width + x0 - rect.x;
    std::copy_n(cell.counts.begin() + static_cast<std::ptrdiff_t>(y) * cell_size, columns,
                result.rays.begin() + to);
  }
}

void TileWorkspace::Impl::render_cell(
    const FrameContext& frame, const TileJob& tile, int x0, int y0, TileResult& result) {
  load_plate(tile, x0, y0);
  KeptTransport* memory = frame.inputs.kept;
  const int column = x0 / cell_size, row = y0 / cell_size;
  const int stage = frame.stage_of(column, row);
  const CellTransport* kept = memory ? memory->find(column, row, stage) : nullptr;
  const bool counts = frame.inputs.count_rays;
  if (kept && (!counts || !kept->counts.empty())) {
    light(frame, *kept, result.statistics);
    result.statistics.kept_rays += kept->rays;
    if (counts) write_counts(*kept, tile, x0, y0, result);
  } else {
    baker.bake(frame, stage, x0, y0, transport, result.statistics);
    light(frame, transport, result.statistics);
    if (counts) write_counts(transport, tile, x0, y0, result);
    // Found in a room of its own, which is as large as the largest needs: what is kept is not.
    if (CellTransport* room = memory ? memory->place(column, row) : nullptr) {
      *room = transport;
      memory->keep(column, row, stage);
    }
  }
  write(frame, tile, x0, y0, result);
}

void render_tile(const FrameContext& context,
                 const TileJob& tile,
                 TileWorkspace& workspace,
                 TileResult& result) {
  prepare_thread();
  for (int y = tile.rect.y; y < tile.rect.y + tile.rect.height; y += cell_size) {
    for (int x = tile.rect.x; x < tile.rect.x + tile.rect.width; x += cell_size) {
      workspace.impl().render_cell(context, tile, x, y, result);
    }
  }
}

}  // namespace render
