// Sharp shadows between the centres of pixels: sources that further samples ask for themselves.
#include <algorithm>

#include "render/cell_baker.h"
#include "render/shadow_stream.h"

namespace render {
namespace {

// Of a lamp that is worth a ray, in terms of the contrast that the effort looks for.
constexpr float least_doubt = 0.0625F;

}  // namespace

// What passes of a compact light, the c-th of them, to a centre that it shines on.
Vec3f CellBaker::compact_at(std::size_t c, std::size_t centre) const {
  if (!in(transport_->visibility.seen[frame_->compact[c]], centre)) return {};
  return compact_shares_.empty() ? Vec3f{1, 1, 1} : compact_shares_[c * cell_pixels + centre];
}

// The same of a lamp that reaches the cell, as irradiance per intensity.
Vec3f CellBaker::lamp_at(std::size_t place, std::size_t centre) const {
  const CellLamps& lamps = transport_->lamps;
  return lamps.passed(place, centre) * lamps.factors[place].at[centre];
}

// Whether a lamp that one of two centres sees shows enough there to be worth rays: it may be one of
// many samples of a screen. Those that are not are other light, which samples share or find anew.
bool CellBaker::lamp_shows(std::size_t place, std::size_t a, std::size_t b) const {
  const CellTransport& t = *transport_;
  const std::size_t seeing = t.lamps.factors[place].at[a] > 0 ? a : b;
  const Vec3f irradiance =
      lamp_at(place, seeing) * frame_->planned_table->lamps[t.lamps.numbers[place]].intensity;
  return std::max(largest(diffuse_of_centre(a) * irradiance),
                  largest(diffuse_of_centre(b) * irradiance)) >
         least_doubt * effort_.glint_contrast;
}

// Calls light(number among the compact ones) and lamp(place in the cell's lamps) for each source
// that casts sharp shadows and that one of two centres sees, the other not.
template <class OfLight, class OfLamp>
void CellBaker::for_each_doubt(std::size_t a, std::size_t b, OfLight&& light, OfLamp&& lamp) const {
  const CellVisibility& cell = transport_->visibility;
  for (std::size_t c = 0; c < frame_->compact.size(); ++c) {
    const std::uint32_t number = frame_->compact[c];
    if (!in(cell.lit[number], a) || !in(cell.lit[number], b)) continue;
    if (in(cell.seen[number], a) != in(cell.seen[number], b)) light(c);
  }
  const CellLamps& lamps = transport_->lamps;
  for (std::size_t i = 0; i < lamps.numbers.size(); ++i) {
    if ((lamps.factors[i].at[a] > 0) == (lamps.factors[i].at[b] > 0)) continue;
    if (!shadow_rays_.is_caustic(lamps.numbers[i]) && lamp_shows(i, a, b)) lamp(i);
  }
}

// Irradiance of those sources at either of two centres.
std::array<Vec3f, 2> CellBaker::light_in_doubt(std::size_t a, std::size_t b) const {
  const CellTransport& t = *transport_;
  const LightTable& planned = *frame_->planned_table;
  std::array<Vec3f, 2> sums{};
  const std::array<std::size_t, 2> centres{a, b};
  for_each_doubt(
      a, b,
      [&](std::size_t c) {
        const DirectionalLight& l = planned.lights[frame_->compact[c]];
        for (std::size_t i = 0; i < 2; ++i) {
          const std::size_t k = centres[i];
          const float cosine = dot(t.centres.front().normal(k), l.direction);
          sums[i] += l.irradiance * compact_at(c, k) * cosine;
        }
      },
      [&](std::size_t place) {
        const Vec3f intensity = planned.lamps[t.lamps.numbers[place]].intensity;
        for (std::size_t i = 0; i < 2; ++i) sums[i] += intensity * lamp_at(place, centres[i]);
      });
  return sums;
}

// Sources that a centre sees otherwise than others about a pixel do that show the same surface.
// Points come pixel by pixel, and nearly always with one lender.
void CellBaker::find_doubts(std::size_t pixel, std::size_t centre) {
  if (doubtful_ == std::array{pixel, centre}) return;
  doubtful_ = {pixel, centre};
  doubts_.clear();
  const auto note = [&](std::size_t number, bool is_lamp) {
    const Doubt doubt{static_cast<std::uint16_t>(number), is_lamp};
    if (std::ranges::find(doubts_, doubt) == doubts_.end()) doubts_.push_back(doubt);
  };
  const int px = static_cast<int>(pixel % cell_size), py = static_cast<int>(pixel / cell_size);
  for (int y = std::max(py - 1, 0); y <= std::min(py + 1, cell_size - 1); ++y) {
    for (int x = std::max(px - 1, 0); x <= std::min(px + 1, cell_size - 1); ++x) {
      const auto other = static_cast<std::size_t>(y * cell_size + x);
      if (other == centre || !in(transport_->receiving, other)) continue;
      if (!met_.continuous(centre, other)) continue;
      for_each_doubt(
          centre, other, [&](std::size_t c) { note(c, false); },
          [&](std::size_t i) { note(i, true); });
    }
  }
}

// Of the first points, those that have a centre's light ask for what is in doubt about their pixel.
void CellBaker::settle_doubts(int count) {
  asked_.clear();
  doubtful_.fill(nowhere);
  clear_receivers();
  Receivers& r = receivers_;
  gather_.notes.begin(shadow_rays_, r, ShadowRays::anywhere);
  std::array<bool, stream_rays> has_lobe{};
  for (const Lobe& lobe : lobes_) has_lobe[index_of(*lobe.point)] = true;
  std::array<std::uint32_t, stream_rays + 1> first_of_point{};
  const auto& instances = frame_->inputs.scene->description().instances;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    first_of_point[i] = static_cast<std::uint32_t>(asked_.size());
    const ShadePoint& p = points_[i];
    if (lender_[i] < 0 || instances[p.hit.instance].kind == ObjectKind::stand_in) continue;
    const auto centre = static_cast<std::size_t>(lender_[i]);
    if (!in(transport_->receiving, centre) || (p.diffuse == Vec3f{} && !has_lobe[i])) continue;
    find_doubts(p.pixel, centre);
    if (doubts_.empty()) continue;
    const auto k = static_cast<std::size_t>(r.count++);
    set_receiver(k, p);
    for (const Doubt& doubt : doubts_) ask_again(p, k, centre, doubt);
  }
  std::fill(first_of_point.begin() + count, first_of_point.end(),
            static_cast<std::uint32_t>(asked_.size()));
  if (asked_.empty()) return;
  flush_asked();
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    for (std::size_t a = first_of_point[i]; a < first_of_point[i + 1]; ++a) {
      add_asked(points_[i], asked_[a]);
    }
  }
  for (const Lobe& lobe : lobes_) {
    const auto i = index_of(*lobe.point);
    for (std::size_t a = first_of_point[i]; a < first_of_point[i + 1]; ++a) {
      const AskedAgain& asked = asked_[a];
      if (!asked.is_lamp) {
        const auto seen = [&](Vec3f passed) { return passed_to_lobe(lobe, asked.number, passed); };
        mirror_compact(lobe, asked.number, seen(asked.passed) - seen(asked.passed_centre));
      } else if (lobe.lamps) {
        add_lamp(lobe, asked.number, asked.passed - asked.passed_centre);
      }
    }
  }
}

// Puts down what a point has of a source by its centre, and sends a ray there.
void CellBaker::ask_again(const ShadePoint& p,
                          std::size_t receiver,
                          std::size_t centre,
                          const Doubt& doubt) {
  const Receivers& r = receivers_;
  const CellTransport& t = *transport_;
  AskedAgain asked;
  asked.is_lamp = doubt.is_lamp;
  Vec3f direction;
  unsigned mask = r.mask[receiver];
  float far_m = 0;  // no ray
  if (doubt.is_lamp) {
    asked.number = t.lamps.numbers[doubt.number];
    asked.per_source_centre = t.lamps.factors[doubt.number].at[centre];
    if (asked.per_source_centre > 0)
      asked.passed_centre = lamp_at(doubt.number, centre) / asked.per_source_centre;
    if (const auto to =
            ray_to_lamp(lamp_receiver(r, receiver), frame_->job->lights.lamps[asked.number])) {
      asked.per_source = to->per_intensity;
      direction = to->direction, far_m = to->far_m;
      mask = mask_virtual | mask_real_blocker;
      if (!(far_m > 0)) asked.passed = {1, 1, 1};
    }
  } else {
    asked.number = static_cast<std::uint16_t>(frame_->compact[doubt.number]);
    direction = frame_->job->lights.lights[asked.number].direction;
    asked.passed_centre = compact_at(doubt.number, centre);
    asked.per_source_centre = dot(t.centres.front().normal(centre), direction);
    const float cosine = dot({r.nx[receiver], r.ny[receiver], r.nz[receiver]}, direction);
    if (cosine > 0 && dot(p.hit.geometric_normal, direction) > 0) {
      asked.per_source = cosine, far_m = ray_far;
      if (p.diffuse != Vec3f{}) mask |= shadow_rays_.mask_to(asked.number);
    }
  }
  const auto number = static_cast<std::uint32_t>(asked_.size());
  asked_.push_back(asked);
  if (!(far_m > 0)) return;
  if (counting_) ++counting_[p.pixel].shadow_rays;
  add_ray(gather_, r, receiver, number, direction, mask, far_m);
  if (gather_.rays == stream_rays) flush_asked();
}

void CellBaker::flush_asked() {
  flush(*frame_->inputs.scene, gather_, *statistics_,
        [&](std::uint32_t, std::uint32_t number, bool blocked, Vec3f share) {
          asked_[number].passed = blocked ? Vec3f{} : share;
        });
}

// What a source gives a point, in place of what its centre has of it.
void CellBaker::add_asked(const ShadePoint& p, const AskedAgain& asked) {
  const Vec3f weight =
      p.throughput * p.diffuse *
      (asked.passed * asked.per_source - asked.passed_centre * asked.per_source_centre);
  if (weight == Vec3f{}) return;
  const LightTable& planned = *frame_->planned_table;
  const float grey = p.painted == not_painted ? 1 : planned_grey;
  if (asked.is_lamp) {
    add_lamp_past_pictures(p, matte_target_of(p), asked.number, weight);
    samples_[p.slot].added += weight * grey * planned.lamps[asked.number].intensity;
  } else {
    add_light_past_pictures(p, matte_target_of(p), planned.lights[asked.number].direction,
                            asked.number, weight);
    samples_[p.slot].added += weight * grey * planned.lights[asked.number].irradiance;
  }
}

}  // namespace render
