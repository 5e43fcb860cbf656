// What rays that are not followed show: the environment, as far as their points see it, and grey.
#include <algorithm>
#include <numbers>

#include "render/cell_baker.h"

namespace render {
namespace {

// What is hidden from a lobe, or would be met by a ray that nobody follows: the albedo that it is
// taken for.
constexpr float surroundings_albedo = 0.3F;

}  // namespace

// A ray that is not followed, and what it would see of the environment.
void CellBaker::note_cut_ray(const ShadePoint& from, Vec3f throughput, LookUp& sees, bool rough) {
  const auto first = static_cast<std::uint32_t>(cut_places_.size());
  cut_places_.insert(cut_places_.end(), sees.places.begin(),
                     sees.places.begin() + static_cast<std::ptrdiff_t>(sees.count));
  cut_rays_.push_back({throughput, decides(from.slot) ? planned_radiance(sees) : Vec3f{}, first,
                       static_cast<std::uint32_t>(cut_places_.size()),
                       static_cast<std::uint16_t>(index_of(from)), rough});
}

// What is in the way of a lobe, in the light of what a pixel's centre shows, which receives light.
void CellBaker::add_surroundings(std::size_t slot,
                                 std::size_t target,
                                 std::size_t pixel,
                                 Vec3f weight) {
  weight = weight * (surroundings_albedo * std::numbers::inv_pi_v<float>);
  if (shades_ring_) {  // of which nothing is kept
  } else if (target == pixel) {
    CellTransport::Centres& c = transport_->centres.front();
    c.diffuse.put(pixel, c.diffuse.at(pixel) + weight);
    c.any_diffuse = true;
    grey_[pixel] += weight;
  } else if (target == cell_pixels + pixel) {
    grey_of_further_[pixel] += weight;
  } else {
    transport_->shared.push_back({static_cast<std::uint16_t>(target),
                                  static_cast<std::uint16_t>(pixel),
                                  CellTransport::SharedTerm::Of::light, weight});
  }
  const Light& light = light_[pixel];
  samples_[slot].added += weight * (light.arriving + light.lamps);
}

// What the points that have just got their light see of it, but for compact lights: these are there
// or not, whatever else of the sky is.
void CellBaker::find_open_sky(int count, bool grid) {
  if (!grid && cut_rays_.empty()) return;
  const auto& lights = frame_->planned_table->lights;
  std::array<float, stream_rays> compact_open{}, compact_arriving{};
  if (grid) {
    const CellVisibility& visibility = transport_->visibility;
    for (const std::uint32_t c : frame_->compact) {
      if (none(transport_->receiving) || none(visibility.lit[c])) continue;
      const DirectionalLight& l = lights[c];
      for (std::size_t k = 0; k < cell_pixels; ++k) {
        if (!in(visibility.lit[c], k)) continue;
        const Vec3f n{receivers_.nx[k], receivers_.ny[k], receivers_.nz[k]};
        const float open = dot(n, l.direction) * mean(l.irradiance);
        compact_open[k] += open;
        if (in(visibility.seen[c], k)) compact_arriving[k] += open;
      }
    }
  } else if (!frame_->compact.empty()) {
    for (const PointLight& t : tested_) {
      const DirectionalLight& l = lights[t.light];
      if (!l.compact) continue;
      compact_open[t.point] += mean(l.irradiance) * t.weight;
      compact_arriving[t.point] += mean(l.irradiance * t.passed) * t.weight;
    }
  }
  // Sums in other orders differ by rounding.
  constexpr float least_sky = 1e-4F;
  const auto share_of = [&](std::size_t i) {
    const Light& light = light_of_point_[i];
    float open = mean(light.open), arriving = mean(light.arriving);
    const float least = least_sky * open;
    if (const std::size_t k = receiver_of_point_[i]; k != nowhere) {
      open -= compact_open[k], arriving -= compact_arriving[k];
    }
    return open > least ? std::clamp(arriving / open, 0.0F, 1.0F) : 1.0F;
  };
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const ShadePoint& p = points_[i];
    if (grid) {
      open_sky_of_centre_[p.pixel] = open_sky_[i] = share_of(i);
    } else if (shades_ring_ && p.depth == 0) {  // that gets no light itself
      open_sky_[i] = open_sky_of_centre_[p.pixel];
    } else if (lender_[i] >= 0) {
      open_sky_[i] = open_sky_of_centre_[static_cast<std::size_t>(lender_[i])];
    } else {
      open_sky_[i] = share_of(i);
    }
  }
}

// Rays that are not followed, of the points that have just got their light: each sees as much of
// the environment as its point does of the sky, or of a rough lobe, and something grey for the
// rest.
void CellBaker::take_from_environment() {
  for (const CutRay& ray : cut_rays_) {
    const ShadePoint& p = points_[ray.point];
    const int lender = lender_[ray.point];
    const std::size_t pixel = lender >= 0 ? static_cast<std::size_t>(lender) : p.pixel;
    const bool is_known = ray.rough && (lender >= 0 || !is_further(p.slot));
    const OpenLobe lobe = is_known ? open_lobes_.at(pixel) : OpenLobe{};
    const float open = lobe.by_lights() + lobe.by_ray() * open_sky_[ray.point];
    if (open > 0) {
      const std::size_t count = ray.last - ray.first_place;
      add_places(p.slot, target_of(p), std::span(cut_places_).subspan(ray.first_place, count),
                 ray.radiance, ray.throughput * open);
    }
    if (open < 1 && in(transport_->receiving, pixel)) {
      add_surroundings(p.slot, target_of(p), pixel, ray.throughput * (1 - open));
    }
  }
  cut_rays_.clear();
  cut_places_.clear();
}

}  // namespace render
