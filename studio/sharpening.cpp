// Stages from frame to frame.
#include "studio/sharpening.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

namespace studio {
namespace {

using render::finished_stage, render::one_ray_stage;

constexpr double share_of_frame = 0.7;  // of its time, for rendering
constexpr double share_at_rest = 0.8;   // ... where nothing is found anew, and cells can wait
constexpr double share_at_least = 0.2;  // for cells, however long the rest takes
constexpr double followed = 0.3;        // of what was measured last, in running means
// What a cell takes at each stage, of the coarsest one's, as long as nothing better is known: as in
// the papers' scenes (`platelight bench drag`), where a few rays at edges are little more than one
// everywhere.
constexpr std::array<double, render::refinement_stages> expected_cost{1, 2, 6, 14, 18, 60};
// Of the cells, as many are found in a frame with a ray a pixel however long they take.
constexpr double least = 0.01;
// By how much more a stage that was never timed is taken to cost, until it was.
constexpr double caution = 4;
// A stage that takes less than this times the one before takes its place.
constexpr double worth_a_stage = 2;

// The step through all cells in which they take their turns, spread over the picture: by the golden
// section (Knuth, "The Art of Computer Programming" 3, 6.4).
std::size_t stride_of(std::size_t cells) {
  auto stride = static_cast<std::size_t>(0.618034 * static_cast<double>(cells)) + 1;
  while (std::gcd(stride, cells) > 1) ++stride;
  return stride;
}

}  // namespace

Sharpening::Sharpening(capture::Rational rate, bool live)
    : frame_ms_(1000 / rate.value()),
      frames_a_second_(rate.value()),
      live_(live),
      cost_(expected_cost) {}

// What a frame may spend.
double Sharpening::budget(std::size_t cells, bool at_rest) const {
  const auto all = static_cast<double>(cells);
  if (!live_) {
    const double rest = cost_[one_ray_stage + 1] + cost_[finished_stage];
    return all * rest / std::max(frames_a_second_ - 1, 1.0);
  }
  if (std::ranges::none_of(timed_, std::identity())) return 0;
  const double share = at_rest ? share_at_rest : share_of_frame;
  const double ms = std::max(share * frame_ms_ - relight_ms_, share_at_least * frame_ms_);
  return std::max(ms, least * all * cost_[one_ray_stage]);
}

// Where a cell goes on to from a stage.
std::size_t Sharpening::after(std::size_t stage) const {
  std::size_t next = stage + 1;
  while (next < finished_stage && cost_[next + 1] < worth_a_stage * cost_[next]) ++next;
  return next;
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
  double left = budget(cells, lost == 0);
  // What is found anew is as fine at once as there is time for.
  std::size_t first = one_ray_stage;
  if (live_) {
    first = 0;
    while (first < finished_stage && static_cast<double>(lost) * cost_[first + 1] <= left) ++first;
  }
  found_.fill(0);
  found_[first] = lost;
  left -= static_cast<double>(lost) * cost_[first];
  for (std::size_t i = 0; i < cells; ++i) {
    if (anew[i]) stages[i] = static_cast<std::uint8_t>(first);
  }
  promoted_ = 0;
  const std::size_t stride = stride_of(cells);
  for (std::size_t stage = 0; stage < finished_stage && !stopped_; ++stage) {
    const std::size_t to = after(stage);
    // A stage is timed the first time by itself.
    const bool untimed = live_ && !timed_[to];
    if (untimed && lost + promoted_ > 0) break;
    for (std::size_t turn = 0; turn < cells; ++turn) {
      if (!(left > 0)) break;
      const std::size_t i = turn * stride % cells;
      if (stages[i] != stage || anew[i]) continue;
      stages[i] = static_cast<std::uint8_t>(to);
      anew[i] = 1;
      ++promoted_;
      ++found_[to];
      left -= cost_[to] * (untimed ? caution : 1);
    }
  }
  const double reached = std::accumulate(stages.begin(), stages.end(), 0.0);
  share_ = reached / static_cast<double>(std::max<std::size_t>(cells, 1) * finished_stage);
  return stages;
}

void Sharpening::took(double render_ms, bool full) {
  full_ = full;
  stopped_ = stopped_ || (full && promoted_ > 0);
  double foreseen = 0;
  for (std::size_t s = 0; s < found_.size(); ++s) {
    foreseen += static_cast<double>(found_[s]) * cost_[s];
  }
  if (!(foreseen > 0)) {
    relight_ms_ = relight_ms_ > 0 ? relight_ms_ + (render_ms - relight_ms_) * followed : render_ms;
    return;
  }
  if (!live_) return;
  const double ratio = std::max(render_ms - relight_ms_, 0.05 * render_ms) / foreseen;
  const bool known = std::ranges::any_of(timed_, std::identity());
  if (!known) {
    for (double& cost : cost_) cost *= ratio;
  }
  for (std::size_t s = 0; s < found_.size(); ++s) {
    if (found_[s] == 0) continue;
    const double part = static_cast<double>(found_[s]) * cost_[s] / foreseen;
    const double change = known ? std::pow(ratio, (timed_[s] ? followed : 1) * part) : 1;
    cost_[s] *= change;
    timed_[s] = true;
    // What is finer and not yet known is guessed from it.
    for (std::size_t finer = s + 1; finer < cost_.size() && !timed_[finer]; ++finer) {
      cost_[finer] *= change;
    }
  }
}

}  // namespace studio
