// Cells of 16x16 pixels: transport, light, and the finished halves.
#include "render/kernel.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <utility>

#include "render/cell_baker.h"
#include "render/kept_transport.h"
#include "render/lanes.h"
#include "render/picture_looker.h"
#include "render/stand_in_parameters.h"
#include "render/trace.h"

namespace render {

struct TileWorkspace::Impl {
  CellBaker baker;
  PictureLooker looker;
  CellTransport transport;
  RelightWorkspace relight;
  CellPicture picture;
  CellPictures pictures;  // of the cell at work
  KeptTransport::CellTimes times;
  std::array<Four, cell_pixels> plate;

  void render_cell(const FrameContext& frame, const TileView& tile, int x0, int y0);
  void load_plate(const TileView& tile, int x0, int y0);
  void light(const FrameContext& frame,
             const CellTransport& cell,
             bool sees_pictures,
             RenderStatistics& statistics);
  void write(const FrameContext& frame, const TileView& tile, int x0, int y0) const;
  bool look(
      const FrameContext& frame, const CellTransport& cell, const TileView& tile, int x0, int y0);
  void write_kept(
      const FrameContext& frame, const CellTransport& cell, const TileView& tile, int x0, int y0);
};

TileWorkspace::TileWorkspace() : impl_(std::make_unique<Impl>()) {}
TileWorkspace::~TileWorkspace() = default;
TileWorkspace::TileWorkspace(TileWorkspace&&) noexcept = default;
TileWorkspace& TileWorkspace::operator=(TileWorkspace&&) noexcept = default;

void TileWorkspace::log_rays(RayLog* log) { impl_->baker.log_rays(log); }

// A row of a cell, as far as it lies in the tile: its first pixel in images of some stride that
// begin at the tile's top left, in the cell, and how many there are.
struct CellRow {
  std::ptrdiff_t in_image;
  std::size_t in_cell, length;
};
template <class Visit>
void for_rows(const TileView& tile, std::ptrdiff_t stride, int x0, int y0, Visit visit) {
  const int columns = std::min(cell_size, tile.rect.x + tile.rect.width - x0);
  const int rows = std::min(cell_size, tile.rect.y + tile.rect.height - y0);
  for (int y = 0; y < rows; ++y) {
    visit(CellRow{(y0 + y - tile.rect.y) * stride + x0 - tile.rect.x,
                  static_cast<std::size_t>(y * cell_size), static_cast<std::size_t>(columns)});
  }
}

// Calls values into the cache, to be read or, `written`, to be put there: the next cell's row,
// while this one's is at work. No machine foresees sixteen rows by itself.
template <int written = 0>
void call_for(const capture::Half* at, std::size_t count) {
  constexpr std::size_t line = 32;
  for (std::size_t i = 0; i < count; i += line) __builtin_prefetch(at + i, written);
  __builtin_prefetch(at + count - 1, written);
}

void TileWorkspace::Impl::load_plate(const TileView& tile, int x0, int y0) {
  if (x0 + cell_size > tile.rect.x + tile.rect.width ||
      y0 + cell_size > tile.rect.y + tile.rect.height)
    plate.fill(Four{});
  std::array<float, 3 * cell_size + 1> floats{};  // the last of a pixel's four is the next one's
  for_rows(tile, tile.plate_stride, x0, y0, [&](const CellRow& row) {
    const capture::Half* from = tile.plate + 3 * row.in_image;
    call_for(from + 3 * cell_size, 3 * cell_size);
    capture::floats_from_halves({from, 3 * row.length}, floats.data());
    for (std::size_t x = 0; x < row.length; ++x) plate[row.in_cell + x] = load_four(&floats[3 * x]);
  });
}

void TileWorkspace::Impl::light(const FrameContext& frame,
                                const CellTransport& cell,
                                bool sees_pictures,
                                RenderStatistics& statistics) {
  if (cell.empty && !sees_pictures) {
    picture.added.fill(Four{});
    picture.share.fill(Four{1, 1, 1, 1});
    picture.seen.fill(1);
    return;
  }
  render::relight(
      cell,
      {frame.job->lights.lights, frame.irradiances, frame.lamps, frame.levels, *frame.bordered},
      plate, relight, picture, statistics, sees_pictures ? &pictures : nullptr);
}

// with_light() of stand_in_parameters.h, of colours in four lanes.
Four with_light(Four plate, Four added) {
  const Four sum = plate + added, none{};
  const Four least = plate < 0 ? plate : none;
  return (added < 0) & (sum < least) ? least : sum;
}

// Halves of values that halves can hold; else the nearest that they can, counted.
void put_halves(std::span<float> values, capture::Half* to, RenderStatistics& statistics) {
  // As bits without the sign: what is no number is above all others.
  std::uint32_t most = 0;
  for (const float value : values) {
    most = std::max(most, std::bit_cast<std::uint32_t>(value) & 0x7FFFFFFF);
  }
  const bool fit = most <= std::bit_cast<std::uint32_t>(capture::half_max);
  for (std::size_t i = 0; !fit && i < values.size(); ++i) {
    float& value = values[i];
    if (std::abs(value) <= capture::half_max) continue;
    ++statistics.clamped_values;
    value = std::isnan(value) ? 0.0F : std::clamp(value, -capture::half_max, capture::half_max);
  }
  capture::halves_from_floats(values, to);
}

void TileWorkspace::Impl::write(const FrameContext& frame,
                                const TileView& tile,
                                int x0,
                                int y0) const {
  const calibrate::DirectionTable& directions = *frame.inputs.directions;
  RenderStatistics& statistics = *tile.statistics;
  std::array<float, cell_size * 4> rgba;
  std::array<float, cell_size> matte;
  int y = y0, virtual_pixels = 0, affected_pixels = 0;
  for_rows(tile, tile.stride, x0, y0, [&](const CellRow& row) {
    const float* sensitivity =
        directions.sensitivity.empty() ? nullptr : &directions.sensitivity[directions.index(y, x0)];
    for (std::size_t x = 0; x < row.length; ++x) {
      const std::size_t k = row.in_cell + x;
      const Four light = sensitivity ? picture.added[k] * sensitivity[x] : picture.added[k];
      const float coverage = 1 - picture.seen[k];
      matte[x] = 1 - picture.share[k][3];
      Four shown = with_light(plate[k] * picture.share[k], light);
      shown[3] = coverage;
      std::memcpy(&rgba[4 * x], &shown, sizeof shown);
      // Of the last of four of what is added, nothing is known.
      const unsigned covered = bits_of(shown > 0) & 8, lit = bits_of(picture.added[k] != 0) & 7;
      virtual_pixels += static_cast<int>(covered >> 3);
      affected_pixels += (lit | covered | static_cast<unsigned>(matte[x] != 0)) != 0;
    }
    call_for<1>(tile.rgba + 4 * (row.in_image + cell_size), 4 * cell_size);
    put_halves(std::span(rgba).first(4 * row.length), tile.rgba + 4 * row.in_image, statistics);
    put_halves(std::span(matte).first(row.length), tile.matte + row.in_image, statistics);
    ++y;
  });
  statistics.virtual_pixels += static_cast<std::uint64_t>(virtual_pixels);
  statistics.affected_pixels += static_cast<std::uint64_t>(affected_pixels);
}

void write_counts(const CellTransport& cell, const TileView& tile, int x0, int y0) {
  for_rows(tile, tile.stride, x0, y0, [&](const CellRow& row) {
    std::copy_n(&cell.counts[row.in_cell], row.length, tile.rays + row.in_image);
  });
}

bool has_plate_of(const LitCell& lit, const TileView& tile, int x0, int y0) {
  bool same = true;
  for_rows(tile, tile.plate_stride, x0, y0, [&](const CellRow& row) {
    same = same && std::memcmp(&lit.plate[3 * row.in_cell], tile.plate + 3 * row.in_image,
                               3 * row.length * sizeof(capture::Half)) == 0;
  });
  return same;
}

void copy_lit(const LitCell& lit, const TileView& tile, int x0, int y0) {
  for_rows(tile, tile.stride, x0, y0, [&](const CellRow& row) {
    std::copy_n(&lit.rgba[4 * row.in_cell], 4 * row.length, tile.rgba + 4 * row.in_image);
    std::copy_n(&lit.matte[row.in_cell], row.length, tile.matte + row.in_image);
  });
  *tile.statistics += lit.statistics;
}

void keep_lit(const TileView& tile, int x0, int y0, LitCell& lit) {
  for_rows(tile, tile.plate_stride, x0, y0, [&](const CellRow& row) {
    std::copy_n(tile.plate + 3 * row.in_image, 3 * row.length, &lit.plate[3 * row.in_cell]);
  });
  for_rows(tile, tile.stride, x0, y0, [&](const CellRow& row) {
    std::copy_n(tile.rgba + 4 * row.in_image, 4 * row.length, &lit.rgba[4 * row.in_cell]);
    std::copy_n(tile.matte + row.in_image, row.length, &lit.matte[row.in_cell]);
  });
}

// Whether anything of the plate is no number, so that even no share of it is none.
bool is_broken_plate(const TileView& tile, int x0, int y0) {
  bool broken = false;
  for_rows(tile, tile.plate_stride, x0, y0, [&](const CellRow& row) {
    const auto values = std::span(tile.plate + 3 * row.in_image, 3 * row.length);
    broken = broken || std::ranges::any_of(
                           values, [](capture::Half value) { return (value & 0x7c00) == 0x7c00; });
  });
  return broken;
}

template <class Work>
void timed(float& ms, const Work& work) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  work();
  ms = std::chrono::duration<float, std::milli>(Clock::now() - start).count();
}

// What the frame's live pictures do to a cell, to `pictures`. Returns whether they do anything.
bool TileWorkspace::Impl::look(
    const FrameContext& frame, const CellTransport& cell, const TileView& tile, int x0, int y0) {
  bool sees = false;
  const auto see = [&] { sees = looker.look(frame, cell, x0, y0, pictures, *tile.statistics); };
  frame.pictures.empty() ? see() : timed(times.look_ms, see);
  return sees;
}

// A cell whose transport is kept: as it was lit last, if nothing that lights it has changed.
void TileWorkspace::Impl::write_kept(
    const FrameContext& frame, const CellTransport& cell, const TileView& tile, int x0, int y0) {
  if (look(frame, cell, tile, x0, y0)) {
    load_plate(tile, x0, y0);
    light(frame, cell, true, *tile.statistics);
    write(frame, tile, x0, y0);
    return;
  }
  KeptTransport& memory = *frame.inputs.kept;
  const int column = x0 / cell_size, row = y0 / cell_size;
  const FrameKeys& keys = memory.keys();
  const LitCell* lit = memory.lit(column, row);
  // Before a frame knows of clear bodies, or while the light changes, its plate has no key.
  const bool knows_plate = cell.bent.empty() || keys.plate_levels.all != 0;
  if (lit && lit->light == keys.light.all && knows_plate &&
      (cell.bent.empty() || lit->plate_levels == keys.plate_levels.all) &&
      (lit->shows_plate ? has_plate_of(*lit, tile, x0, y0) : !is_broken_plate(tile, x0, y0))) {
    copy_lit(*lit, tile, x0, y0);
    return;
  }
  load_plate(tile, x0, y0);
  TileView apart = tile;
  RenderStatistics statistics;
  apart.statistics = &statistics;
  light(frame, cell, false, statistics);
  write(frame, apart, x0, y0);
  const bool can_stay = cell.video.empty() && knows_plate;
  if (LitCell* room = can_stay ? memory.place_lit(column, row) : nullptr) {
    keep_lit(tile, x0, y0, *room);
    room->light = keys.light.all;
    room->plate_levels = keys.plate_levels.all;
    room->shows_plate = !cell.catchers.empty() || is_broken_plate(tile, x0, y0) ||
                        std::any_of(picture.share.begin(), picture.share.begin() + cell_pixels,
                                    [](Four share) { return three_of(share) != Vec3f{}; });
    room->statistics = statistics;
  }
  *tile.statistics += statistics;
}

void TileWorkspace::Impl::render_cell(const FrameContext& frame,
                                      const TileView& tile,
                                      int x0,
                                      int y0) {
  KeptTransport* memory = frame.inputs.kept;
  const int column = x0 / cell_size, row = y0 / cell_size;
  const int stage = frame.stage_of(column, row);
  const CellTransport* kept = memory ? memory->find(column, row, stage) : nullptr;
  const bool counts = frame.inputs.count_rays;
  times = {};
  if (kept && (!counts || !kept->counts.empty())) {
    write_kept(frame, *kept, tile, x0, y0);
    tile.statistics->kept_rays += kept->rays;
    if (counts) write_counts(*kept, tile, x0, y0);
  } else {
    load_plate(tile, x0, y0);
    timed(times.find_ms, [&] { baker.bake(frame, stage, x0, y0, transport, *tile.statistics); });
    light(frame, transport, look(frame, transport, tile, x0, y0), *tile.statistics);
    if (counts) write_counts(transport, tile, x0, y0);
    // Found in a room of its own, which is as large as the largest needs: what is kept is not.
    if (memory) memory->found_with(baker.scratch_bytes());
    if (CellTransport* room = memory ? memory->place(column, row, stage) : nullptr) {
      *room = transport;
      memory->keep(column, row, stage);
    }
    write(frame, tile, x0, y0);
  }
  if (memory) memory->took(column, row, times);
}

bool find_cell(const FrameContext& context,
               int column,
               int row,
               int stage,
               TileWorkspace& workspace,
               RenderStatistics& statistics) {
  prepare_thread();
  KeptTransport& memory = *context.inputs.kept;
  CellTransport* room = memory.place(column, row, stage);
  if (!room) return false;
  TileWorkspace::Impl& impl = workspace.impl();
  impl.baker.bake(context, stage, column * cell_size, row * cell_size, impl.transport, statistics);
  memory.found_with(impl.baker.scratch_bytes());
  *room = impl.transport;
  memory.keep(column, row, stage);
  return memory.find(column, row, stage) != nullptr;
}

void render_tile(const FrameContext& context, const TileView& tile, TileWorkspace& workspace) {
  prepare_thread();
  for (int y = tile.rect.y; y < tile.rect.y + tile.rect.height; y += cell_size) {
    for (int x = tile.rect.x; x < tile.rect.x + tile.rect.width; x += cell_size) {
      workspace.impl().render_cell(context, tile, x, y);
    }
  }
}

void render_tile(const FrameContext& context,
                 const TileJob& tile,
                 TileWorkspace& workspace,
                 TileResult& result) {
  const Rect& rect = tile.rect;
  const Rect& plate = tile.background_rect;
  const auto first = std::ptrdiff_t{rect.y - plate.y} * plate.width + rect.x - plate.x;
  render_tile(context,
              {.rect = rect,
               .plate = tile.background.data() + 3 * first,
               .plate_stride = plate.width,
               .rgba = result.rgba.data(),
               .matte = result.matte.data(),
               .rays = result.rays.data(),
               .stride = rect.width,
               .statistics = &result.statistics},
              workspace);
}

}  // namespace render
