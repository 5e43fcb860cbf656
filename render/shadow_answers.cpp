// Shadow rays written down, and asked again where something moved.
#include "render/shadow_answers.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "render/blocker_boxes.h"
#include "render/box_meets.h"
#include "render/lamp_way.h"
#include "render/light_gather.h"
#include "render/shadow_stream.h"
#include "render/soft_lights.h"

namespace render {
namespace {

float largest_coordinate(const Scene::Bounds& b) {
  return std::max({std::abs(b.lower.x), std::abs(b.lower.y), std::abs(b.lower.z),
                   std::abs(b.upper.x), std::abs(b.upper.y), std::abs(b.upper.z)});
}

// Boxes grow by such shares of coordinates and sizes: by more than rays are off where they meet
// them.
constexpr float off_by = 1e-5F, larger_by = 1e-3F;
// In the place of a direction's coordinate that is 0.
constexpr float hardly = 1e-20F;
Scene::Bounds grown_for(const Scene::Bounds& b, const Scene::Bounds& from) {
  const float off = off_by * (largest_coordinate(b) + largest_coordinate(from));
  const Vec3f by = (b.upper - b.lower) * larger_by + Vec3f{off, off, off};
  return {b.lower - by, b.upper + by};
}

std::array<float, 3> parts(Vec3f v) { return {v.x, v.y, v.z}; }

// As may_be_met(), of eight ranges of directions at once.
unsigned may_be_met(const Scene::Bounds& things,
                    const Scene::Bounds& from,
                    const std::array<Eight, 3>& least,
                    const std::array<Eight, 3>& largest) {
  const Eight none{}, tiny = eight_of(1e-12F), minus_tiny = eight_of(-1e-12F);
  Eight near_t{}, far_t = eight_of(ray_far);
  auto may = near_t == none;
  // Leaves those t >= 0 for which t * most >= bound.
  const auto reach = [&](float bound, const Eight& most) {
    const Eight at = bound / most;
    const auto along = most >= tiny, back = most <= minus_tiny;
    near_t = along & (at > near_t) ? at : near_t;
    far_t = back & (at < far_t) ? at : far_t;
    if (bound > 0) may = may & (along | back);
  };
  const auto from_lower = parts(from.lower), from_upper = parts(from.upper),
             lower = parts(things.lower), upper = parts(things.upper);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    reach(lower[axis] - from_upper[axis], largest[axis]);
    reach(from_lower[axis] - upper[axis], -least[axis]);
  }
  return bits_of(may & (near_t <= far_t));
}

}  // namespace

MovedInLight::MovedInLight(std::span<const Scene::Bounds> where,
                           std::size_t lights,
                           const SoftLights& soft) {
  for (const Scene::Bounds& b : where) {
    const auto same = std::ranges::find_if(where_, [&](const auto& w) { return overlap(w, b); });
    if (same == where_.end()) {
      where_.push_back(b);
    } else {
      *same = joined(*same, b);
    }
  }
  const std::size_t filled = (lights + 7) / 8 * 8;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    least_[axis].resize(filled), largest_[axis].resize(filled);
    for (std::size_t i = 0; i < lights; ++i) {
      least_[axis][i] = parts(soft.range(i).lower)[axis];
      largest_[axis][i] = parts(soft.range(i).upper)[axis];
    }
  }
}

void MovedInLight::seen_from(const Scene::Bounds& box, std::vector<Scene::Bounds>& things) const {
  things.clear();
  for (const Scene::Bounds& b : where_) things.push_back(grown_for(b, box));
}

void MovedInLight::find_shaded(std::span<const Scene::Bounds> things,
                               const Scene::Bounds& box,
                               std::vector<std::uint8_t>& lights) const {
  lights.assign(least_[0].size(), 0);
  for (std::size_t first = 0; first < lights.size(); first += 8) {
    std::array<Eight, 3> least, largest;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      least[axis] = load_eight(&least_[axis][first]);
      largest[axis] = load_eight(&largest_[axis][first]);
    }
    unsigned may = 0;
    for (const Scene::Bounds& b : things) may |= may_be_met(b, box, least, largest);
    for (std::size_t i = 0; i < 8; ++i) lights[first + i] = may >> i & 1;
  }
}

void ShadowAnswers::begin(bool keeps) {
  known_ = keeps;
  receivers_.clear(), rays_.clear(), free_.clear(), runs_.clear(), groups_.clear();
  unasked_.clear();
}

std::size_t ShadowAnswers::bytes() const {
  const auto of = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  return of(receivers_) + of(rays_) + of(free_) + of(runs_) + of(groups_) + of(unasked_);
}

ShadowAnswers::Answer ShadowAnswers::answer_of(const GatherWorkspace& w,
                                               std::size_t ray,
                                               bool filters) {
  if (w.far_m[ray] < 0) return Answer::blocked;
  const bool dimmed = filters && (w.tr[ray] != 1 || w.tg[ray] != 1 || w.tb[ray] != 1);
  return dimmed ? Answer::dimmed : Answer::passes;
}

ShadowAnswers::Way ShadowAnswers::way(const LightContext& context,
                                      const Run& run,
                                      std::size_t ray) const {
  const LightTable& table = *context.table;
  const auto& [number, part, answer] = rays_[ray];
  const Receiver& from = receivers_[number];
  const auto to_light = [&] {
    return part == SoftLights::middle ? table.lights[run.number].direction
                                      : context.parts->direction(run.number, part);
  };
  switch (run.to) {
    case ShadowRays::to_lights:
      return {to_light(), ray_far};
    case ShadowRays::near_to_lights:
      return {to_light(), from.sharp_m / table.lights[run.number].spread};
    case ShadowRays::to_lamps: {
      const WayTo<float> to = way_to(from.origin, table.lamps[run.number].position);
      return {to.direction, to.distance_m * before_lamp};
    }
    case ShadowRays::anywhere:
      break;
  }
  return free_[run.first_free + ray - run.first];
}

bool ShadowAnswers::differ(const LightContext& context,
                           const MovedInLight& moved,
                           LivePictures pictures,
                           GatherWorkspace& w) const {
  const bool filters = context.scene->has_filters();
  RenderStatistics unused;
  std::array<Answer, stream_rays> before;
  w.rays = 0;
  w.log = nullptr, w.counts = nullptr;
  w.notes.begin_cell(nullptr);
  w.pictures = pictures;
  const auto other_answers = [&] {
    if (w.rays == 0) return false;
    shoot(*context.scene, w, unused);
    const auto count = static_cast<std::size_t>(std::exchange(w.rays, 0));
    for (std::size_t i = 0; i < count; ++i) {
      if (answer_of(w, i, filters) != before[i]) return true;
    }
    return false;
  };
  std::vector<Scene::Bounds> things;
  std::vector<std::uint8_t> shaded;  // of each light
  std::size_t group = groups_.size();
  for (std::size_t n = 0; n < runs_.size(); ++n) {
    const Run& run = runs_[n];
    const Scene::Bounds& box = groups_[run.group].box;
    if (run.group != group) {
      group = run.group;
      moved.seen_from(box, things);
      moved.find_shaded(things, box, shaded);
    }
    const bool to_lights = run.to == ShadowRays::to_lights || run.to == ShadowRays::near_to_lights;
    if (to_lights && shaded[run.number] == 0) continue;
    const std::size_t end = n + 1 < runs_.size() ? runs_[n + 1].first : rays_.size();
    for (std::size_t i = run.first; i < end; ++i) {
      const Ray& ray = rays_[i];
      const Receiver& from = receivers_[ray.receiver];
      const auto [direction, far_m] = way(context, run, i);
      const auto meets = [&](const Scene::Bounds& b) {
        return render::meets(b, from.origin, direction, far_m);
      };
      if (std::ranges::none_of(things, meets)) continue;
      if (ray.answer == Answer::dimmed) return true;
      const auto k = static_cast<std::size_t>(w.rays++);
      w.ox[k] = from.origin.x, w.oy[k] = from.origin.y, w.oz[k] = from.origin.z;
      w.dx[k] = direction.x, w.dy[k] = direction.y, w.dz[k] = direction.z;
      w.mask[k] = from.mask, w.far_m[k] = far_m;
      before[k] = ray.answer;
      if (w.rays == stream_rays && other_answers()) return true;
    }
  }
  if (other_answers()) return true;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const std::size_t end = g + 1 < groups_.size() ? groups_[g + 1].first_unasked : unasked_.size();
    for (std::size_t i = groups_[g].first_unasked; i < end; ++i) {
      if (context.can_be_blocked(groups_[g].box, unasked_[i])) return true;
    }
  }
  return false;
}

void ShadowNotes::begin_cell(ShadowAnswers* to, std::span<const Scene::Bounds> moving) {
  to_ = to;
  moving_.assign(moving.begin(), moving.end());
  if (moving.size() > most_moving) {
    moving_.resize(1);
    for (const Scene::Bounds& b : moving) moving_[0] = joined(moving_[0], b);
  }
}

// Of eight rays of the stream, those that may meet anything that may move.
unsigned ShadowNotes::meet_moving(const GatherWorkspace& w, std::size_t first) const {
  const std::array from{load_eight(&w.ox[first]), load_eight(&w.oy[first]),
                        load_eight(&w.oz[first])};
  std::array per_metre{load_eight(&w.dx[first]), load_eight(&w.dy[first]),
                       load_eight(&w.dz[first])};
  const Eight none{};
  Eight farthest{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    per_metre[axis] = 1 / (per_metre[axis] == none ? eight_of(hardly) : per_metre[axis]);
    const Eight off = from[axis] < none ? -from[axis] : from[axis];
    farthest = off > farthest ? off : farthest;
  }
  unsigned meet = 0;
  for (const Scene::Bounds& b : moving_) {
    const auto lower = parts(b.lower), upper = parts(b.upper);
    const Eight off = (farthest + largest_coordinate(b)) * off_by;
    Eight near_m{}, far_m = eight_of(ray_far);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Eight wide = off + (upper[axis] - lower[axis]) * larger_by;
      const Eight a = (lower[axis] - wide - from[axis]) * per_metre[axis];
      const Eight c = (upper[axis] + wide - from[axis]) * per_metre[axis];
      const Eight in = a < c ? a : c, out = a < c ? c : a;
      near_m = in > near_m ? in : near_m;
      far_m = out < far_m ? out : far_m;
    }
    meet |= ~bits_of(near_m > far_m);
  }
  return meet;
}

void ShadowNotes::begin(const LightContext& context, const Receivers& receivers, ShadowRays to) {
  if (!wants()) return;
  context_ = &context, from_ = &receivers, rays_to_ = to;
  number_.fill(none);
  if (to_->groups_.size() == none) return to_->forget();
  to_->groups_.push_back({no_bounds, static_cast<std::uint32_t>(to_->unasked_.size())});
}

void ShadowNotes::leave_out(std::uint32_t light, const Scene::Bounds& box) {
  if (!wants()) return;
  Scene::Bounds& all = to_->groups_.back().box;
  all = joined(all, box);
  to_->unasked_.push_back(static_cast<std::uint16_t>(light));
}

std::uint16_t ShadowNotes::receiver(Vec3f origin, std::uint32_t mask, float sharp_m) {
  auto& receivers = to_->receivers_;
  if (receivers.size() == none) {
    to_->forget();
    return 0;
  }
  receivers.push_back({origin, mask, sharp_m});
  Scene::Bounds& box = to_->groups_.back().box;
  box = joined(box, {origin, origin});
  return static_cast<std::uint16_t>(receivers.size() - 1);
}

void ShadowNotes::begin_run(std::uint32_t number, ShadowRays to) {
  const auto group = static_cast<std::uint16_t>(to_->groups_.size() - 1);
  auto& runs = to_->runs_;
  if (!runs.empty() && runs.back().group == group && runs.back().to == to &&
      (runs.back().number == number || to == ShadowRays::anywhere)) {
    return;
  }
  runs.push_back({static_cast<std::uint32_t>(to_->rays_.size()),
                  static_cast<std::uint32_t>(to_->free_.size()), static_cast<std::uint16_t>(number),
                  group, to});
}

void ShadowNotes::note(const GatherWorkspace& w) {
  if (!wants()) return;
  const bool filters = context_->scene->has_filters();
  const auto count = static_cast<std::size_t>(w.rays);
  const bool near = rays_to_ == ShadowRays::near_to_lights;
  unsigned stays = 0;  // of eight rays
  for (std::size_t i = 0; i < count; ++i) {
    if (i % 8 == 0) {
      stays = bits_of(load_eight(&w.far_m[i]) < Eight{});
      if (stays != 0) stays &= ~meet_moving(w, i);
    }
    if ((stays >> (i % 8) & 1) != 0) continue;
    if (to_->rays_.size() == ShadowAnswers::most_rays) return to_->forget();
    std::uint16_t& number = number_[w.ray_point[i]];
    const auto is_same = [&](const ShadowAnswers::Receiver& r) {
      return r.mask == w.mask[i] && (!near || r.sharp_m == w.sharp_m[w.ray_point[i]]);
    };
    if (number == none || !is_same(to_->receivers_[number])) {
      number = receiver({w.ox[i], w.oy[i], w.oz[i]}, w.mask[i], w.sharp_m[w.ray_point[i]]);
      if (!wants()) return;
    }
    const std::uint32_t light = w.ray_light[i];
    begin_run(light, rays_to_);
    const Vec3f direction{w.dx[i], w.dy[i], w.dz[i]};
    std::uint8_t part = SoftLights::middle;
    if (rays_to_ == ShadowRays::anywhere) {
      to_->free_.push_back({direction, w.reach_m[i]});
    } else if (rays_to_ != ShadowRays::to_lamps &&
               direction != context_->table->lights[light].direction) {
      part = from_->part[w.ray_point[i]];
    }
    to_->rays_.push_back({number, part, ShadowAnswers::answer_of(w, i, filters)});
  }
}

void ShadowNotes::note(Vec3f origin, std::uint32_t mask, Vec3f direction, bool blocked) {
  if (!wants()) return;
  if (to_->rays_.size() == ShadowAnswers::most_rays) return to_->forget();
  const std::uint16_t number = receiver(origin, mask, 0);
  if (!wants()) return;
  begin_run(0, ShadowRays::anywhere);
  to_->free_.push_back({direction, ray_far});
  to_->rays_.push_back({number, SoftLights::middle,
                        blocked ? ShadowAnswers::Answer::blocked : ShadowAnswers::Answer::passes});
}

}  // namespace render
