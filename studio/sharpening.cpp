// Stages from frame to frame.
#include "studio/sharpening.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace studio {
namespace {

using render::finished_stage, render::one_ray_stage;

constexpr double share_of_frame = 0.6;  // of its time, for rendering
constexpr double share_at_least = 0.2;  // for cells, however long the rest takes
constexpr double followed = 0.3;        // of what was measured last, in running means
// What a stage takes, in cells of the coarsest.
constexpr std::array<double, render::refinement_stages> cost{1, 4, 16, 64, 256, 1024};
// Of the cells, as many are found in a frame with a ray a pixel however long they take.
constexpr double least = 0.01 * cost[one_ray_stage];

// The step through all cells in which they take their turns, spread over the picture: by the golden
// section (Knuth, "The Art of Computer Programming" 3, 6.4).
std::size_t stride_of(std::size_t cells) {
  auto stride = static_cast<std::size_t>(0.618034 * static_cast<double>(cells)) + 1;
  while (std::gcd(stride, cells) > 1) ++stride;
  return stride;
}

}  // namespace

Sharpening::Sharpening(capture::Rational rate, bool live)
    : frame_ms_(1000 / rate.value()), frames_a_second_(rate.value()), live_(live) {}

// What a frame may spend, in coarse cells.
double Sharpening::budget(std::size_t cells) const {
  const auto all = static_cast<double>(cells);
  if (!live_) {
    const double rest = cost[one_ray_stage + 1] + cost[finished_stage];
    return all * rest / std::max(frames_a_second_ - 1, 1.0);
  }
  if (!(cell_ms_ > 0)) return 0;
  const double ms = std::max(share_of_frame * frame_ms_ - relight_ms_, share_at_least * frame_ms_);
  return std::max(ms / cell_ms_, least * all);
}

std::vector<std::uint8_t> Sharpening::next(std::span<const int> kept) {
  const std::size_t cells = kept.size();
  std::vector<std::uint8_t> stages(cells);
  std::vector<std::uint8_t> anew(cells);
  std::size_t lost = 0;
  for (std::size_t i = 0; i < cells; ++i) {
    anew[i] = kept[i] == render::KeptTransport::none;
    lost += anew[i];
    stages[i] = static_cast<std::uint8_t>(std::max(kept[i], 0));
  }
  if (!full_) stopped_ = false;
  double left = budget(cells);
  // What is found anew is as fine at once as there is time for.
  std::size_t first = one_ray_stage;
  if (live_) {
    first = 0;
    while (first < finished_stage && static_cast<double>(lost) * cost[first + 1] <= left) ++first;
  }
  spent_ = static_cast<double>(lost) * cost[first];
  left -= spent_;
  for (std::size_t i = 0; i < cells; ++i) {
    if (anew[i]) stages[i] = static_cast<std::uint8_t>(first);
  }
  promoted_ = 0;
  const std::size_t stride = stride_of(cells);
  for (std::size_t stage = 0; stage < finished_stage && !stopped_; ++stage) {
    for (std::size_t turn = 0; turn < cells; ++turn) {
      if (!(left > 0)) break;
      const std::size_t i = turn * stride % cells;
      if (stages[i] != stage || anew[i]) continue;
      ++stages[i];
      anew[i] = 1;
      ++promoted_;
      spent_ += cost[stage + 1];
      left -= cost[stage + 1];
    }
  }
  const double reached = std::accumulate(stages.begin(), stages.end(), 0.0);
  share_ = reached / static_cast<double>(std::max<std::size_t>(cells, 1) * finished_stage);
  return stages;
}

void Sharpening::took(double render_ms, bool full) {
  full_ = full;
  stopped_ = stopped_ || (full && promoted_ > 0);
  if (spent_ > 0) {
    const double each = std::max(render_ms - relight_ms_, 0.05 * render_ms) / spent_;
    cell_ms_ = cell_ms_ > 0 ? cell_ms_ + (each - cell_ms_) * followed : each;
  } else {
    relight_ms_ = relight_ms_ > 0 ? relight_ms_ + (render_ms - relight_ms_) * followed : render_ms;
  }
}

}  // namespace studio
