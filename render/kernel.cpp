// Cells of 16x16 pixels: transport, light, and the finished halves.
#include "render/kernel.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

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
  void write_kept(const FrameContext& frame,
                  const CellTransport& cell,
                  const TileJob& tile,
                  int x0,
                  int y0,
                  TileResult& result);
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
  render::relight(cell, {frame.job->lights.lights, frame.lamps, frame.levels}, plate, relight,
                  picture, statistics);
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

// A row of a cell, as far as it lies in the tile: in images of the tile's width and `channels`
// values a pixel, and in the cell's own.
struct CellRow {
  std::size_t in_image, in_cell, length;
};
template <class Visit>
void for_rows(
    const Rect& image, const Rect& tile, int x0, int y0, std::size_t channels, Visit visit) {
  const int columns = std::min(cell_size, tile.x + tile.width - x0);
  const int rows = std::min(cell_size, tile.y + tile.height - y0);
  for (int y = 0; y < rows; ++y) {
    const int at = (y0 + y - image.y) * image.width + x0 - image.x;
    visit(CellRow{static_cast<std::size_t>(at) * channels,
                  static_cast<std::size_t>(y * cell_size) * channels,
                  static_cast<std::size_t>(columns) * channels});
  }
}

bool has_plate_of(const LitCell& lit, const TileJob& tile, int x0, int y0) {
  bool same = true;
  for_rows(tile.background_rect, tile.rect, x0, y0, 3, [&](const CellRow& row) {
    same = same && std::memcmp(&lit.plate[row.in_cell], &tile.background[row.in_image],
                               row.length * sizeof(capture::Half)) == 0;
  });
  return same;
}

void copy_lit(const LitCell& lit, const TileJob& tile, int x0, int y0, TileResult& result) {
  for_rows(tile.rect, tile.rect, x0, y0, 4, [&](const CellRow& row) {
    std::copy_n(&lit.rgba[row.in_cell], row.length, &result.rgba[row.in_image]);
  });
  for_rows(tile.rect, tile.rect, x0, y0, 1, [&](const CellRow& row) {
    std::copy_n(&lit.matte[row.in_cell], row.length, &result.matte[row.in_image]);
  });
  result.statistics += lit.statistics;
}

void keep_lit(const TileResult& result, const TileJob& tile, int x0, int y0, LitCell& lit) {
  for_rows(tile.background_rect, tile.rect, x0, y0, 3, [&](const CellRow& row) {
    std::copy_n(&tile.background[row.in_image], row.length, &lit.plate[row.in_cell]);
  });
  for_rows(tile.rect, tile.rect, x0, y0, 4, [&](const CellRow& row) {
    std::copy_n(&result.rgba[row.in_image], row.length, &lit.rgba[row.in_cell]);
  });
  for_rows(tile.rect, tile.rect, x0, y0, 1, [&](const CellRow& row) {
    std::copy_n(&result.matte[row.in_image], row.length, &lit.matte[row.in_cell]);
  });
}

// Whether anything of the plate is no number, so that even no share of it is none.
bool is_broken_plate(const TileJob& tile, int x0, int y0) {
  bool broken = false;
  for_rows(tile.background_rect, tile.rect, x0, y0, 3, [&](const CellRow& row) {
    const auto values = std::span(tile.background).subspan(row.in_image, row.length);
    broken = broken || std::ranges::any_of(
                           values, [](capture::Half value) { return (value & 0x7c00) == 0x7c00; });
  });
  return broken;
}

// A cell whose transport is kept: as it was lit last, if nothing that lights it has changed.
void TileWorkspace::Impl::write_kept(const FrameContext& frame,
                                     const CellTransport& cell,
                                     const TileJob& tile,
                                     int x0,
                                     int y0,
                                     TileResult& result) {
  KeptTransport& memory = *frame.inputs.kept;
  const int column = x0 / cell_size, row = y0 / cell_size;
  const FrameKeys& keys = memory.keys();
  const LitCell* lit = memory.lit(column, row);
  if (lit && lit->light == keys.light.all &&
      (cell.bent.empty() || lit->plate_levels == keys.plate_levels.all) &&
      (lit->shows_plate ? has_plate_of(*lit, tile, x0, y0) : !is_broken_plate(tile, x0, y0))) {
    copy_lit(*lit, tile, x0, y0, result);
    return;
  }
  load_plate(tile, x0, y0);
  const RenderStatistics before = std::exchange(result.statistics, {});
  light(frame, cell, result.statistics);
  write(frame, tile, x0, y0, result);
  if (LitCell* room = cell.video.empty() ? memory.place_lit(column, row) : nullptr) {
    keep_lit(result, tile, x0, y0, *room);
    room->light = keys.light.all;
    room->plate_levels = keys.plate_levels.all;
    room->shows_plate =
        !cell.catchers.empty() || is_broken_plate(tile, x0, y0) ||
        std::ranges::any_of(picture.share, [](Vec3f share) { return share != Vec3f{}; });
    room->statistics = result.statistics;
  }
  result.statistics += before;
}

void TileWorkspace::Impl::render_cell(
    const FrameContext& frame, const TileJob& tile, int x0, int y0, TileResult& result) {
  KeptTransport* memory = frame.inputs.kept;
  const int column = x0 / cell_size, row = y0 / cell_size;
  const int stage = frame.stage_of(column, row);
  const CellTransport* kept = memory ? memory->find(column, row, stage) : nullptr;
  const bool counts = frame.inputs.count_rays;
  if (kept && (!counts || !kept->counts.empty())) {
    write_kept(frame, *kept, tile, x0, y0, result);
    result.statistics.kept_rays += kept->rays;
    if (counts) write_counts(*kept, tile, x0, y0, result);
  } else {
    load_plate(tile, x0, y0);
    baker.bake(frame, stage, x0, y0, transport, result.statistics);
    light(frame, transport, result.statistics);
    if (counts) write_counts(transport, tile, x0, y0, result);
    // Found in a room of its own, which is as large as the largest needs: what is kept is not.
    if (CellTransport* room = memory ? memory->place(column, row) : nullptr) {
      *room = transport;
      memory->keep(column, row, stage);
    }
    write(frame, tile, x0, y0, result);
  }
}

bool find_cell(const FrameContext& context,
               int column,
               int row,
               int stage,
               TileWorkspace& workspace,
               RenderStatistics& statistics) {
  prepare_thread();
  KeptTransport& memory = *context.inputs.kept;
  CellTransport* room = memory.place(column, row);
  if (!room) return false;
  TileWorkspace::Impl& impl = workspace.impl();
  impl.baker.bake(context, stage, column * cell_size, row * cell_size, impl.transport, statistics);
  *room = impl.transport;
  memory.keep(column, row, stage);
  return memory.find(column, row, stage) != nullptr;
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
