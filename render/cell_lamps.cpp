// The set's lamps at a cell's points.
#include <numbers>

#include "render/cell_baker.h"

namespace render {

// At the centres, after their other light is known.
void CellBaker::add_centre_lamps(std::span<const std::uint16_t> receiver_of_point) {
  if (receivers_.by_lamps == CellMask{} || frame_->planned_table->lamps.empty()) return;
  CellLamps& cell = transport_->lamps;
  gather_cell_lamps(shadow_rays_, receivers_, gather_, cell, *statistics_);
  const auto planned = [&](std::size_t place) {
    return frame_->planned_table->lamps[cell.numbers[place]].intensity;
  };
  bool dims = false;
  for (std::size_t i = 0; i < cell.numbers.size(); ++i) {
    const Vec3f intensity = planned(i);
    for (std::size_t k = 0; k < cell_pixels; ++k) {
      light_[k].lamps += intensity * cell.factors[i].at[k];
      dims = dims || (cell.factors[i].at[k] > 0 &&
                      may_dim_lamp({receivers_.px[k], receivers_.py[k], receivers_.pz[k]},
                                   cell.numbers[i]));
    }
  }
  if (dims && transport_->shadowed.empty()) {
    keep_shadowed(receivers_.active, transport_->shadowed);
  }
  for (const TintedLight& tint : cell.tints) {
    light_[tint.centre].lamps -=
        planned(tint.light) * tint.lost_share * cell.factors[tint.light].at[tint.centre];
  }
  for (std::size_t i = 0; i < receiver_of_point.size(); ++i) {
    const std::size_t k = receiver_of_point[i];
    if (k == nowhere) continue;
    light_of_point_[i].lamps = light_[k].lamps;
    catch_lamps(points_[i], k, light_[k].lamps);
  }
}

// At points that are no centres, whose catchers add_tested has made.
void CellBaker::add_point_lamps(std::span<const std::uint16_t> point_of_receiver) {
  if (frame_->planned_table->lamps.empty()) return;
  reached_.clear();
  gather_point_lamps(shadow_rays_, receivers_, gather_, reached_, *statistics_);
  CellTransport& t = *transport_;
  for (const PointLamp& l : reached_) {
    const std::size_t i = point_of_receiver[l.point];
    const ShadePoint& p = points_[i];
    const Vec3f factor = l.factor();
    const Vec3f irradiance = factor * frame_->planned_table->lamps[l.lamp].intensity;
    const Vec3f weight = p.throughput * p.diffuse * factor;
    light_of_point_[i].lamps += irradiance;
    if (weight != Vec3f{}) {
      add_lamp_past_pictures(p, matte_target_of(p), l.lamp, weight);
    }
    if (bent_of_receiver_[l.point] != no_catcher && shadow_rays_.is_caustic(l.lamp)) {
      t.bent_caustics.push_back({bent_of_receiver_[l.point], l.lamp, factor});
    }
    const std::uint32_t catcher = catcher_of_receiver_[l.point];
    if (catcher == no_catcher) continue;
    // What lamps add to the plate there is not looked at again.
    const std::size_t r = l.point;
    needs_pictures_ = needs_pictures_ ||
                      may_dim_lamp({receivers_.px[r], receivers_.py[r], receivers_.pz[r]}, l.lamp);
    t.caught.push_back({catcher, l.lamp, factor});
    samples_[p.slot].added +=
        p.throughput * p.albedo * irradiance * (1 / std::numbers::pi_v<float>);
  }
}

// At a stand-in's point that has the light of a centre.
void CellBaker::catch_lamps(const ShadePoint& p, std::size_t centre, Vec3f irradiance) {
  if (!p.catches_lamps || irradiance == Vec3f{}) return;
  needs_pictures_ = needs_pictures_ || p.behind != no_picture_ray;
  transport_->catchers.push_back({static_cast<std::uint16_t>(target_of(p)),
                                  static_cast<std::uint32_t>(centre), p.throughput, p.albedo});
  const Vec3f caught = p.throughput * p.albedo * irradiance * (1 / std::numbers::pi_v<float>);
  samples_[p.slot].added += caught;
  if (p.depth == 0) first_[p.slot] += caught;
}

}  // namespace render
