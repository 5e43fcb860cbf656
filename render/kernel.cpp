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

// Calls values into the cache: the next cell's row, while this one's is at work. No machine
// foresees sixteen rows by itself.
void call_for(const capture::Half* at, std::size_t count) {
  constexpr std::size_t line = 32;
  for (std::size_t i = 0; i < count; i += line) __builtin_prefetch(at + i);
  __builtin_prefetch(at + count - 1);
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

// Halves of values some of which halves cannot hold: the nearest that they can, counted.
void put_clamped(std::span<float> values, capture::Half* to, RenderStatistics& statistics) {
  for (float& value : values) {
    if (std::abs(value) <= capture::half_max) continue;
    ++statistics.clamped_values;
    value = std::isnan(value) ? 0.0F : std::clamp(value, -capture::half_max, capture::half_max);
  }
  capture::halves_from_floats(values, to);
}

// Whether halves can hold all that it has seen.
class FitsHalves {
 public:
  void see(Four v) {
    // As bits without the sign: what is no number is above all others.
    const Words bits = std::bit_cast<Words>(v) & 0x7FFFFFFF;
    most_ = bits > most_ ? bits : most_;
  }
  explicit operator bool() const {
    return bits_of(most_ > std::bit_cast<std::int32_t>(capture::half_max)) == 0;
  }

 private:
  using Words = std::int32_t __attribute__((vector_size(16)));
  Words most_{};
};

void TileWorkspace::Impl::write(const FrameContext& frame,
                                const TileView& tile,
                                int x0,
                                int y0) const {
  const calibrate::DirectionTable& directions = *frame.inputs.directions;
  RenderStatistics& statistics = *tile.statistics;
  int y = y0, virtual_pixels = 0, affected_pixels = 0;
  for_rows(tile, tile.stride, x0, y0, [&](const CellRow& row) {
    const float* sensitivity =
        directions.sensitivity.empty() ? nullptr : &directions.sensitivity[directions.index(y, x0)];
    capture::Half* const to_rgba = tile.rgba + 4 * row.in_image;
    capture::Half* const to_matte = tile.matte + row.in_image;
    std::array<float, cell_size * 4> rgba;
    std::array<float, cell_size> matte;
    FitsHalves fits;
    for (std::size_t x = 0; x < row.length; ++x) {
      const std::size_t k = row.in_cell + x;
      const Four added = picture.added[k], share = picture.share[k], dimmed = 1 - share;
      Four shown = with_light(plate[k] * share, sensitivity ? added * sensitivity[x] : added);
      shown[3] = 1 - picture.seen[k];
      fits.see(shown), fits.see(dimmed);
      // Halves at once, and floats for a row that does not fit.
      stream_halves(shown, to_rgba + 4 * x);
      to_matte[x] = capture::half_from_float(dimmed[3]);
      std::memcpy(&rgba[4 * x], &shown, sizeof shown);
      matte[x] = dimmed[3];
      // Of the last of four of what is added, nothing is known.
      const unsigned covered = bits_of(shown > 0) & 8;
      const unsigned affected = (bits_of(added != 0) & 7) | covered | (bits_of(dimmed != 0) & 8);
      virtual_pixels += static_cast<int>(covered >> 3);
      affected_pixels += affected != 0;
    }
    if (!fits) {
      put_clamped(std::span(rgba).first(4 * row.length), to_rgba, statistics);
      put_clamped(std::span(matte).first(row.length), to_matte, statistics);
    }
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
  const bool knows_plate = !cell.bends_plate() || keys.plate_levels.all != 0;
  if (lit && lit->light == keys.light.all && knows_plate &&
      (!cell.bends_plate() || lit->plate_levels == keys.plate_levels.all) &&
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
  const bool can_stay = cell.video.empty() && cell.painted.empty() && knows_plate;
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

FoundCell find_cell(const FrameContext& context,
                    int column,
                    int row,
                    int stage,
                    std::chrono::steady_clock::time_point give_up,
                    TileWorkspace& workspace,
                    RenderStatistics& statistics) {
  prepare_thread();
  KeptTransport& memory = *context.inputs.kept;
  CellTransport* room = memory.place(column, row, stage);
  if (!room) return FoundCell::has_no_room;
  TileWorkspace::Impl& impl = workspace.impl();
  try {
    impl.baker.bake(context, stage, column * cell_size, row * cell_size, impl.transport, statistics,
                    give_up);
  } catch (const TakesTooLong&) {
    return FoundCell::takes_too_long;
  }
  memory.found_with(impl.baker.scratch_bytes());
  *room = impl.transport;
  memory.keep(column, row, stage);
  return memory.find(column, row, stage) ? FoundCell::kept : FoundCell::has_no_room;
}

void render_tile(const FrameContext& context, const TileView& tile, TileWorkspace& workspace) {
  prepare_thread();
  for (int y = tile.rect.y; y < tile.rect.y + tile.rect.height; y += cell_size) {
    for (int x = tile.rect.x; x < tile.rect.x + tile.rect.width; x += cell_size) {
      workspace.impl().render_cell(context, tile, x, y);
    }
  }
  end_stream();
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
