// One frame on this machine's threads.
#include "render/renderer.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <mutex>
#include <numeric>
#include <stdexcept>

#include "capture/parallel_loop.h"
#include "render/kept_transport.h"
#include "render/kernel.h"

namespace render {
namespace {

// Threads keep their workspaces from frame to frame.
tbb::enumerable_thread_specific<TileWorkspace>& workspaces() {
  static tbb::enumerable_thread_specific<TileWorkspace> all;
  return all;
}

void size_image(capture::HalfImage& image, int height, int width, int channels) {
  image.height = height;
  image.width = width;
  image.channels = channels;
  image.pixels.resize(static_cast<std::size_t>(height) * static_cast<std::size_t>(width) *
                      static_cast<std::size_t>(channels));
}

// The frame's tiles, row by row, but those first whose cells to be found take most.
std::vector<int> tiles_by_work(const FrameContext& context, int size, int columns, int rows) {
  std::vector<int> order(static_cast<std::size_t>(columns * rows)), work(order.size());
  std::iota(order.begin(), order.end(), 0);
  const KeptTransport* kept = context.inputs.kept;
  if (!kept) return order;
  const int width = context.inputs.directions->width, height = context.inputs.directions->height;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const int x0 = order[i] % columns * size, y0 = order[i] / columns * size;
    for (int y = y0; y < std::min(y0 + size, height); y += cell_size) {
      for (int x = x0; x < std::min(x0 + size, width); x += cell_size) {
        const int stage = context.stage_of(x / cell_size, y / cell_size);
        if (!kept->find(x / cell_size, y / cell_size, stage)) work[i] += 1 << 2 * stage;
      }
    }
  }
  std::ranges::stable_sort(order, std::greater(),
                           [&](int i) { return work[static_cast<std::size_t>(i)]; });
  return order;
}

void check_plate(const FrameInputs& inputs, const capture::HalfImage& plate) {
  const int width = inputs.directions->width, height = inputs.directions->height;
  if (plate.width != width || plate.height != height || plate.channels != 3 ||
      plate.pixels.size() != plate.index(height, 0)) {
    throw std::invalid_argument("the plate is " + std::to_string(plate.width) + "x" +
                                std::to_string(plate.height) + ", but its lens is for " +
                                std::to_string(width) + "x" + std::to_string(height));
  }
}

}  // namespace

std::shared_ptr<FrameContext> prepare_frame(const FrameInputs& inputs,
                                            const FrameJob& job,
                                            const capture::HalfImage& plate) {
  FrameInputs with_plate = inputs;
  with_plate.plate = &plate;
  auto context = std::make_shared<FrameContext>(make_frame_context(with_plate, job));
  check_plate(inputs, plate);
  return context;
}

void refine_cells(const FrameContext& context,
                  std::span<Refinement> cells,
                  std::chrono::steady_clock::time_point deadline,
                  std::chrono::steady_clock::duration most,
                  FrameJob& job,
                  RenderStatistics& statistics) {
  using Clock = std::chrono::steady_clock;
  if (cells.empty()) return;
  std::atomic<std::size_t> next = 0;
  std::atomic<bool> full = false;
  std::mutex statistics_mutex;
  const auto columns = static_cast<std::size_t>(context.columns);
  // Each thread takes the next cell as long as there is time: cells differ by a hundred times in
  // what they take, so that no share of them given out before would keep all threads at work.
  const auto work = [&](int) {
    TileWorkspace& workspace = workspaces().local();
    RenderStatistics taken;
    for (Clock::time_point start; !full && (start = Clock::now()) < deadline;) {
      const std::size_t i = next++;
      if (i >= cells.size()) break;
      Refinement& one = cells[i];
      const bool bounded = most < Clock::time_point::max() - start;
      const FoundCell found = find_cell(
          context, static_cast<int>(one.cell % columns), static_cast<int>(one.cell / columns),
          one.stage, bounded ? start + most : Clock::time_point::max(), workspace, taken);
      one.took_ms = std::chrono::duration<float, std::milli>(Clock::now() - start).count();
      one.given_up = found == FoundCell::takes_too_long;
      if (found == FoundCell::kept) job.stages[one.cell] = one.stage;
      if (found == FoundCell::has_no_room) full = true;
    }
    const std::lock_guard lock(statistics_mutex);
    statistics += taken;
  };
  capture::parallel_for(0, tbb::this_task_arena::max_concurrency(), work,
                        tbb::simple_partitioner());
}

void render_frame(const FrameInputs& inputs,
                  const FrameJob& job,
                  const capture::HalfImage& plate,
                  FrameResult& result) {
  render_frame(*prepare_frame(inputs, job, plate), plate, result);
}

void render_frame(const FrameContext& context,
                  const capture::HalfImage& plate,
                  FrameResult& result) {
  const FrameInputs& inputs = context.inputs;
  const FrameJob& job = *context.job;
  check_stages(context);
  check_plate(inputs, plate);
  const int width = inputs.directions->width, height = inputs.directions->height;
  size_image(result.rgba, height, width, 4);
  size_image(result.matte, height, width, 1);
  result.statistics = {};
  result.rays.width = inputs.count_rays ? width : 0;
  result.rays.height = inputs.count_rays ? height : 0;
  result.rays.pixels.resize(static_cast<std::size_t>(result.rays.width) *
                            static_cast<std::size_t>(result.rays.height));
  const int size = job.effort.tile_size;
  const int columns = (width + size - 1) / size, rows = (height + size - 1) / size;
  std::mutex statistics_mutex;
  const auto render = [&](int i) {
    Rect rect{i % columns * size, i / columns * size, size, size};
    rect.width = std::min(size, width - rect.x);
    rect.height = std::min(size, height - rect.y);
    const auto first = static_cast<std::ptrdiff_t>(rect.y) * width + rect.x;
    RenderStatistics statistics;
    render_tile(context,
                {.rect = rect,
                 .plate = plate.pixels.data() + 3 * first,
                 .plate_stride = width,
                 .rgba = result.rgba.pixels.data() + 4 * first,
                 .matte = result.matte.pixels.data() + first,
                 .rays = inputs.count_rays ? result.rays.pixels.data() + first : nullptr,
                 .stride = width,
                 .statistics = &statistics},
                workspaces().local());
    const std::lock_guard lock(statistics_mutex);
    result.statistics += statistics;
  };
  // One after the other, those with most to find first: a few of them hold nearly all the work, and
  // no thread may be left with one of those when the others are done.
  const std::vector<int> order = tiles_by_work(context, size, columns, rows);
  std::atomic<std::size_t> next = 0;
  capture::parallel_for(
      tbb::blocked_range<int>(0, columns * rows),
      [&](const tbb::blocked_range<int>& tiles) {
        for (int i = tiles.begin(); i != tiles.end(); ++i) render(order[next++]);
      },
      tbb::simple_partitioner());
}

}  // namespace render
