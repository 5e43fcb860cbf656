// Stages from frame to frame.
#include "studio/sharpening.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <numeric>

#include <fmt/format.h>

namespace studio {
namespace {

using render::finished_stage, render::one_ray_stage;

constexpr double share_of_frame = 0.7;  // of its time, for rendering
constexpr double share_at_rest = 0.88;  // ... where nothing is found anew, and cells can wait
// So many frames that are late, more than others, make cells coarser, until they should take less
// in the mean; not where looking takes less than a part of their time, nor any more once
// that twice in a row brought hardly a part of what was foreseen, until looking takes otherwise.
constexpr double share_when_late = 1, share_when_shed = 0.85, looks_that_matter = 0.05;
constexpr double part_that_helps = 0.1, looks_that_differ = 0.25;
constexpr int frames_to_tell = 8, most_in_vain = 2;
constexpr double least_gain = 0.25;  // of what is wanted: looks that are less are not worth it
// Cells that show persons go on no more from that share of a frame's time on, others do.
constexpr double share_for_persons = 0.75;
constexpr double share_at_least = 0.2;  // for cells, however long the rest takes
// What a frame may take that finds no cell anew, where cells go beyond the effort: they make it
// more.
constexpr double share_for_finer = 0.5;
constexpr double followed = 0.3;  // of what was measured last, in running means
// What a cell takes at each stage, of the coarsest one's, as long as nothing better is known: as in
// the papers' scenes (`platelight bench drag`), where a few rays at edges are little more than one
// everywhere.
constexpr std::array<double, render::refinement_stages> expected_cost{1, 2, 6, 14, 15, 18, 60, 130};
// Of the cells, as many are found in a frame with a ray a pixel however long they take.
constexpr double least = 0.01;
// A stage that takes less than this times the one before takes its place.
constexpr double worth_a_stage = 2.5;
// Smooth edges, which are to be there within a second: where they can, or nearly, only those stages
// come first that take a small part of the time.
constexpr std::size_t anti_aliased = render::smoothed_stage;
constexpr double small_part = 0.0625, seconds_to_go_straight = 1.5;

// A cell may hold a live frame up for so many frames. Those that took such a part, or more, of what
// one took before that was given up then, wait: in each frame for what is more by so much.
constexpr double most_frames_of_cell = 3, part_that_waits = 0.9, forgotten_in_frame = 1.01;
// While something moves, for so many: others wait until it stands. So beyond the effort: others
// stay.
constexpr double most_frames_of_quick = 0.25;

// As the effort asks is all that is asked for.
std::size_t sharp(std::uint8_t stage) { return std::min<std::size_t>(stage, finished_stage); }

constexpr double room_for_finer = 0.5;  // of the memory for what is kept

// The step through all cells in which they take their turns, spread over the picture: by the golden
// section (Knuth, "The Art of Computer Programming" 3, 6.4).
std::size_t stride_of(std::size_t cells) {
  auto stride = static_cast<std::size_t>(0.618034 * static_cast<double>(cells)) + 1;
  while (std::gcd(stride, cells) > 1) ++stride;
  return stride;
}

// Where a cell goes back to that takes too long.
std::uint8_t coarser(std::uint8_t stage) {
  if (stage > anti_aliased) return one_ray_stage;
  return static_cast<std::uint8_t>(std::min<int>(stage, one_ray_stage) - 1);
}

}  // namespace

Sharpening::Sharpening(capture::Rational rate, bool live)
    : frame_ms_(1000 / rate.value()),
      frames_a_second_(rate.value()),
      live_(live),
      cost_(expected_cost) {
  least_of_slow_ms_.fill(HUGE_VAL);
}

double Sharpening::most_of_cell_ms() const {
  if (!live_) return HUGE_VAL;
  return (moves_ || beyond_ ? most_frames_of_quick : most_frames_of_cell) * frame_ms_;
}

bool Sharpening::takes_too_long(std::size_t cell, std::size_t to) const {
  const CellTime& time = cell_times_[cell];
  if (time.too_fine != 0 && to >= time.too_fine) return true;
  if (moves_ && time.too_fine_in_motion != 0 && to >= time.too_fine_in_motion) return true;
  return time.stage != 0 && double{time.ms} * cost_[to] / cost_[time.stage] > most_of_cell_ms();
}
bool Sharpening::may_take_too_long(std::size_t cell, std::size_t to) const {
  const CellTime& time = cell_times_[cell];
  return time.stage != 0 && double{time.ms} >= least_of_slow_ms_[to];
}

// What was found ahead of the last frame, cell by cell.
void Sharpening::follow_cells() {
  for (double& ms : least_of_slow_ms_) ms *= forgotten_in_frame;
  for (const render::Refinement& one : plan_.ahead) {
    if (!(one.took_ms > 0)) continue;
    CellTime& time = cell_times_[one.cell];
    if (!one.given_up) {
      time.stage = one.stage, time.ms = one.took_ms;
      continue;
    }
    (moves_ ? time.too_fine_in_motion : time.too_fine) = one.stage;
    if (moves_) continue;
    if (time.stage == 0) continue;
    double& least_ms = least_of_slow_ms_[one.stage];
    least_ms = std::min(least_ms, part_that_waits * double{time.ms});
  }
}

std::string Sharpening::why_coarse() const {
  if (share() >= 1 || moves_) return "";
  if (stopped_) {
    return fmt::format(
        "the memory for what is kept is used up: the picture gets no sharper while nothing moves, "
        "and stays at a sharpness of {:.2f}; a lower [effort] can be finished",
        share());
  }
  const bool goes_on = std::ranges::any_of(
      plan_.ahead, [](const render::Refinement& one) { return one.stage <= finished_stage; });
  if (slow_cells_ == 0 || waiting_cells_ > 0 || goes_on) return "";
  const double part = static_cast<double>(slow_cells_) / static_cast<double>(plan_.stages.size());
  return fmt::format(
      "{:.1f} % of the picture would hold a frame up by more than {:.0f} frames to be found finer: "
      "it stays at a sharpness of {:.2f}; a lower [effort] can be finished",
      100 * part, most_frames_of_cell, share());
}

// What a live frame may spend on cells that are lost, or else go on: these can wait, where finer
// ones would take longer to look at.
double Sharpening::rest_ms(bool at_rest) const {
  if (std::ranges::none_of(timed_, std::identity())) return 0;
  const double share = at_rest ? share_at_rest : share_of_frame;
  return std::max(share * frame_ms_ - relight_ms(), share_at_least * frame_ms_);
}
double Sharpening::time_to_go_on(bool at_rest) const {
  if (!looks_matter()) return rest_ms(at_rest);
  return std::clamp(share_at_rest * frame_ms_ - relight_ms(), 0.0, rest_ms(at_rest));
}

// What is found anew is as fine at once as there is time for.
std::size_t Sharpening::stage_of_lost(std::size_t lost) const {
  if (!live_) return one_ray_stage;
  const auto cells = static_cast<double>(plan_.stages.size());
  const double ms = std::max(rest_ms(lost == 0), least * cells * cost_[one_ray_stage]);
  std::size_t stage = 0;
  while (stage < finished_stage && static_cast<double>(lost) * cost_[stage + 1] <= ms) ++stage;
  return stage;
}

// Where a cell goes on to from a stage, while so many have no rays at edges yet.
std::size_t Sharpening::after(std::size_t stage, std::size_t coarse) const {
  std::size_t next = stage + 1;
  if (live_ && stage < anti_aliased &&
      static_cast<double>(coarse) * cost_[anti_aliased] <=
          seconds_to_go_straight * frames_a_second_ * rest_ms(true)) {
    next = anti_aliased;
    for (std::size_t s = stage + 1; s < anti_aliased; ++s) {
      if (cost_[s] <= small_part * cost_[anti_aliased]) next = s;
    }
    return next;
  }
  const std::size_t last = stage < anti_aliased ? anti_aliased : finished_stage;
  while (next < last && cost_[next + 1] < worth_a_stage * cost_[next]) ++next;
  return next;
}

// Lists the cells that go on, the coarsest first: in a live show all of them, for it is seen how
// far the time goes; otherwise as many as `left` is the cost of.
void Sharpening::go_on(double left, std::span<const float> looks_ms, int last) {
  const bool persons_wait = live_ && looks_matter() && relight_ms() > share_for_persons * frame_ms_;
  const std::vector<std::uint8_t>& stages = plan_.stages;
  const auto coarse = static_cast<std::size_t>(
      std::ranges::count_if(stages, [](std::uint8_t stage) { return stage < anti_aliased; }));
  const std::size_t stride = stride_of(stages.size());
  for (std::size_t stage = 0; stage < static_cast<std::size_t>(last); ++stage) {
    if (stage == finished_stage) {
      if (!plan_.ahead.empty()) break;  // these may take longer
      beyond_ = true;
    }
    const std::size_t to = after(stage, coarse);
    for (std::size_t turn = 0; turn < stages.size() && left > 0; ++turn) {
      const std::size_t i = turn * stride % stages.size();
      if (stages[i] != stage || (persons_wait && looks_much(looks_ms[i]))) continue;
      std::size_t there = to;
      while (live_ && there > stage && takes_too_long(i, there)) --there;
      slow_cells_ += there < to && stage < finished_stage;
      if (there == stage) continue;
      if (live_ && may_take_too_long(i, there)) {
        waiting_cells_ += stage < finished_stage;
        continue;
      }
      plan_.ahead.push_back({i, static_cast<std::uint8_t>(there)});
      if (!live_) left -= cost_[to];
    }
  }
}

// Also where they did before cells became coarser for them.
bool Sharpening::looks_matter() const {
  return std::max(looks_ms_, shed_.before_ms) > looks_that_matter * frame_ms_;
}
// More than its part: all cells look a little.
bool Sharpening::looks_much(float look_ms) const {
  return look_ms * static_cast<double>(plan_.stages.size()) > looks_ms_;
}

// Cells that are to be coarser, for looking at persons in them makes frames late: those in which
// that takes most.
std::vector<std::size_t> Sharpening::too_costly(std::span<const float> looks_ms) {
  if (!live_ || !looks_matter() || shed_.late < frames_to_tell ||
      mean_ms() <= share_when_late * frame_ms_) {
    return {};
  }
  const bool same_looks = std::abs(looks_ms_ - shed_.looks_ms) < looks_that_differ * shed_.looks_ms;
  if (shed_.in_vain >= most_in_vain && same_looks) return {};
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < looks_ms.size(); ++i) {
    if (looks_much(looks_ms[i]) && plan_.stages[i] > 0) order.push_back(i);
  }
  std::ranges::stable_sort(order, std::greater(), [&](std::size_t i) { return looks_ms[i]; });
  const double wanted_ms = mean_ms() - share_when_shed * frame_ms_;
  if (looks_ms_ < least_gain * wanted_ms) return {};
  double finding_ms = 0;
  std::size_t count = 0;
  shed_.before_ms = looks_ms_;
  for (; count < order.size() && shed_.foreseen_ms < wanted_ms &&
         finding_ms < share_of_frame * frame_ms_;
       ++count) {
    shed_.foreseen_ms += looks_ms[order[count]];
    finding_ms += cost_[coarser(plan_.stages[order[count]])];
  }
  order.resize(count);
  return order;
}

SharpeningPlan& Sharpening::next(std::span<const int> kept,
                                 std::span<const float> looks_ms,
                                 int last) {
  looks_ms_ = std::accumulate(looks_ms.begin(), looks_ms.end(), 0.0);
  if (!(looks_ms_ > 0)) shed_ = {};
  const bool told = told_.has_value();
  follow_last_frame();
  constexpr int none = render::KeptTransport::none;
  cell_times_.resize(kept.size());
  follow_cells();
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (kept[i] == none) cell_times_[i] = {};
  }
  slow_cells_ = waiting_cells_ = 0;
  plan_.stages.resize(kept.size());
  plan_.ahead.clear();
  beyond_ = false;
  const auto lost = static_cast<std::size_t>(std::ranges::count(kept, none));
  moves_ = live_ && lost > 0;
  const std::size_t first = stage_of_lost(lost);
  lost_.fill(0);
  lost_[first] = lost;
  double left = 0;
  if (live_) {
    left = time_to_go_on(lost == 0);
  } else {
    double rest = 0;
    for (std::size_t stage = one_ray_stage; stage < finished_stage;) {
      stage = after(stage, 0);
      rest += cost_[stage];
    }
    left = static_cast<double>(kept.size()) * rest / std::max(frames_a_second_ - 1, 1.0);
  }
  left -= static_cast<double>(lost) * cost_[first];
  if (!live_ || moves_ || relight_ms() > share_for_finer * frame_ms_) last = finished_stage;
  // Lost cells have their turn in the frames after.
  std::ranges::transform(kept, plan_.stages.begin(), [](int stage) {
    return static_cast<std::uint8_t>(stage == none ? render::finer_stage : stage);
  });
  if (shed_.foreseen_ms > 0 && told) {
    const bool helped = shed_.before_ms - looks_ms_ > part_that_helps * shed_.foreseen_ms;
    shed_.in_vain = helped ? 0 : shed_.in_vain + 1;
    shed_.looks_ms = looks_ms_;
    shed_.foreseen_ms = 0;
  }
  const std::vector<std::size_t> shed = too_costly(looks_ms);
  shed_.now = !shed.empty();
  for (const std::size_t i : shed) plan_.stages[i] = coarser(plan_.stages[i]);
  if (!full_) stopped_ = false;
  if (!stopped_ && !shed_.now) go_on(left, looks_ms, last);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (kept[i] == none) plan_.stages[i] = static_cast<std::uint8_t>(first);
  }
  went_on_ = !live_ && !plan_.ahead.empty();
  if (!live_) {
    for (const render::Refinement& one : plan_.ahead) plan_.stages[one.cell] = one.stage;
    plan_.ahead.clear();
  }
  reached_ = 0;
  for (const std::uint8_t stage : plan_.stages) reached_ += sharp(stage);
  plan_.ahead_ms = std::max(left, 0.0);
  return plan_;
}

void Sharpening::found_ahead(std::span<const std::uint8_t> stages, double ms) {
  ByStage<std::size_t> found{};
  double in_vain_ms = 0, all_ms = 0;
  for (const render::Refinement& one : plan_.ahead) {
    all_ms += one.took_ms;
    if (one.given_up) in_vain_ms += one.took_ms;
    if (stages[one.cell] != one.stage) continue;
    ++found[one.stage];
    reached_ += sharp(one.stage) - sharp(plan_.stages[one.cell]);
  }
  went_on_ = !plan_.ahead.empty();
  if (moves_ && in_vain_ms > 0) return;  // the others are the quick ones
  learn(found, all_ms > 0 ? ms * (1 - in_vain_ms / all_ms) : ms);
}

void Sharpening::took(double render_ms, double finding_ms, bool full) {
  full_ = full;
  stopped_ = stopped_ || (full && went_on_);
  if (!live_) return;
  if (shed_.now) {
    shed_.late = 0;
    return;  // what that took is no cost of lost cells
  }
  learn(lost_, finding_ms);
  told_ = {render_ms - finding_ms, render_ms};
}

// Means of what a frame takes but for looks, of which the last ones count: when a person comes, it
// is known at once what that takes.
void Sharpening::follow_last_frame() {
  if (!told_) return;
  const auto follow = [&](double& mean, double ms) {
    const double rest = std::max(ms - looks_ms_, 0.0);
    mean = mean > 0 ? mean + (rest - mean) * followed : rest;
  };
  follow(relight_but_looks_ms_, told_->relight_ms);
  follow(all_but_looks_ms_, told_->render_ms);
  const bool late = told_->render_ms > share_when_late * frame_ms_;
  shed_.late = std::clamp(shed_.late + (late ? 1 : -1), 0, frames_to_tell);
  told_.reset();
}

double Sharpening::share() const {
  return static_cast<double>(reached_) /
         static_cast<double>(std::max<std::size_t>(plan_.stages.size(), 1) * finished_stage);
}

double Sharpening::lost_share() const {
  return static_cast<double>(std::accumulate(lost_.begin(), lost_.end(), std::size_t{0})) /
         static_cast<double>(std::max<std::size_t>(plan_.stages.size(), 1));
}

// Costs, from what cells of these stages took together.
void Sharpening::learn(const ByStage<std::size_t>& found, double ms) {
  double foreseen = 0;
  for (std::size_t s = 0; s < found.size(); ++s) {
    foreseen += static_cast<double>(found[s]) * cost_[s];
  }
  if (!(foreseen > 0) || !(ms > 0)) return;
  const double ratio = ms / foreseen;
  const bool known = std::ranges::any_of(timed_, std::identity());
  if (!known) {
    for (double& cost : cost_) cost *= ratio;
  }
  for (std::size_t s = 0; s < found.size(); ++s) {
    if (found[s] == 0) continue;
    const double part = static_cast<double>(found[s]) * cost_[s] / foreseen;
    const double change = known ? std::pow(ratio, (timed_[s] ? followed : 1) * part) : 1;
    cost_[s] *= change;
    timed_[s] = true;
    // What is finer and not yet known is guessed from it.
    for (std::size_t finer = s + 1; finer < cost_.size() && !timed_[finer]; ++finer) {
      cost_[finer] *= change;
    }
  }
}

void render_sharpening(Sharpening& sharpening,
                       const render::FrameInputs& inputs,
                       render::FrameJob& job,
                       const capture::HalfImage& plate,
                       render::FrameResult& result) {
  using Clock = std::chrono::steady_clock;
  using Milliseconds = std::chrono::duration<double, std::milli>;
  const Clock::time_point start = Clock::now();
  const auto frame = render::prepare_frame(inputs, job, plate);
  // What is kept of finer cells takes more room: what goes beyond the effort leaves enough for what
  // does not.
  const bool finer = render::can_be_finer(job.effort) &&
                     static_cast<double>(inputs.kept->bytes()) <
                         room_for_finer * static_cast<double>(inputs.kept->room());
  SharpeningPlan& plan = sharpening.next(inputs.kept->stages(), inputs.kept->looks_ms(),
                                         finer ? render::finer_stage : finished_stage);
  job.stages = plan.stages;
  render::RenderStatistics ahead;
  const Clock::time_point begun = Clock::now();
  const auto time = std::chrono::duration_cast<Clock::duration>(Milliseconds(plan.ahead_ms));
  const double most_ms = sharpening.most_of_cell_ms();
  const auto most = std::isfinite(most_ms)
                        ? std::chrono::duration_cast<Clock::duration>(Milliseconds(most_ms))
                        : Clock::duration::max();
  render::refine_cells(*frame, plan.ahead, begun + time, most, job, ahead);
  const Milliseconds ahead_ms = Clock::now() - begun;
  sharpening.found_ahead(job.stages, ahead_ms.count());
  render::render_frame(*frame, plate, result);
  result.statistics += ahead;
  const Milliseconds all_ms = Clock::now() - start;
  sharpening.took((all_ms - ahead_ms).count(), inputs.kept->finding_ms(), inputs.kept->is_full());
}

}  // namespace studio
