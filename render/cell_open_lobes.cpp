// What rough lobes see of the sky: by the lights of the table, where one ray would not do.
#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "render/cell_baker.h"
#include "render/lanes.h"

namespace render {
namespace {

// Of blocks of pixels that share what they see, and how many of them lie beside each other.
constexpr std::size_t side = 4, in_row = cell_size / side;

std::size_t block_of(std::size_t k) { return k / cell_size / side * in_row + k % cell_size / side; }

// What is hidden from a lobe, or would be met by a ray that nobody follows: the albedo that it is
// taken for.
constexpr float surroundings_albedo = 0.3F;

}  // namespace

// Of a centre's lobes the roughest stands for all.
void CellBaker::note_rough_lobe(const ShadePoint& from, const NewRay& ray) {
  RoughLobe& lobe = rough_lobes_[from.slot];
  if (lobe.point != nowhere && lobe.roughness >= ray.roughness) return;
  lobe = {static_cast<std::uint16_t>(&from - points_.data()), ray.roughness, ray.normal};
}

// A ray that is not followed, and what it would see of the environment.
void CellBaker::note_cut_ray(const ShadePoint& from, Vec3f throughput, LookUp& sees, bool rough) {
  const auto first = static_cast<std::uint32_t>(cut_places_.size());
  cut_places_.insert(cut_places_.end(), sees.places.begin(),
                     sees.places.begin() + static_cast<std::ptrdiff_t>(sees.count));
  cut_rays_.push_back({throughput, decides(from.slot) ? planned_radiance(sees) : Vec3f{}, first,
                       static_cast<std::uint32_t>(cut_places_.size()),
                       static_cast<std::uint16_t>(&from - points_.data()), rough});
}

// Of the lobe at a centre: the share of the table's light in it that those pixels of a word of the
// cell's see. Compact lights are looked for by themselves.
//
// As a ratio, by which what the lobe sees of the environment is multiplied: after Heitz, Hill and
// McGuire, "Combining Analytic Direct Illumination and Stochastic Shadows", I3D 2018.
CellBaker::OpenLobe CellBaker::open_lobe(std::size_t rough,
                                         std::size_t word,
                                         std::uint64_t members) const {
  const RoughLobe& lobe = rough_lobes_[rough];
  const ShadePoint& p = points_[lobe.point];
  const SeenLobe seen_lobe(lobe.normal, p.hit.geometric_normal, -p.incoming);
  const CellVisibility& visibility = transport_->visibility;
  const LightRows& rows = frame_->light_rows;
  const auto count = [](std::uint64_t pixels) { return static_cast<float>(std::popcount(pixels)); };
  const std::size_t block =
      block_of(word * 64 + static_cast<std::size_t>(std::countr_zero(members)));
  const std::uint64_t of_block = transport_->receiving[word] & block4 << block % in_row * side;
  Eight all{}, open{}, squares{};
  for (std::size_t row = 0; row < rows.wide; row += 8) {
    Eight lit{}, seen{};
    for (std::size_t i = 0; i < std::min<std::size_t>(8, rows.wide - row); ++i) {
      const std::size_t number = rows.number[row + i];
      lit[i] = count(visibility.lit[number][word] & members);
      seen[i] = count(visibility.seen[number][word] & members);
      if (tinted_.empty()) continue;
      const float taken = tinted_[number * in_row * in_row + block];
      seen[i] = std::max(seen[i] - taken * count(members) / count(of_block), 0.0F);
    }
    const calibrate::Vec3T<Eight> to{load_eight(&rows.x[row]), load_eight(&rows.y[row]),
                                     load_eight(&rows.z[row])};
    const Eight light = load_eight(&rows.sum[row]) *
                        seen_lobe.blurred(lobe.roughness, load_eight(&rows.spread[row]), to);
    all += light * lit, open += light * seen, squares += light * lit * (light * lit);
  }
  const auto sum = [](const Eight& v) {
    return ((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7]));
  };
  const float total = sum(all), of_squares = sum(squares);
  if (!(total > 0) || !(of_squares > 0)) return {};
  return {std::min(sum(open) / total, 1.0F), total * total / of_squares};
}

// What glass takes of the lights, by blocks.
void CellBaker::sum_tints() {
  const CellVisibility& visibility = transport_->visibility;
  tinted_.clear();
  if (visibility.tints.empty()) return;
  tinted_.resize(visibility.lit.size() * in_row * in_row);
  for (const TintedLight& tint : visibility.tints) {
    tinted_[tint.light * in_row * in_row + block_of(tint.centre)] += mean(tint.lost_share);
  }
}

// Of centres with rough lobes, by blocks of 4x4 pixels that show one surface, and between these.
void CellBaker::find_open_lobes() {
  struct OfBlock {
    std::uint32_t surface;
    OpenLobe lobe;
  };
  struct Block {
    std::array<OfBlock, side * side> surfaces;
    std::size_t count = 0;
  };
  CellMask rough{};
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    rough[k / 64] |= std::uint64_t{rough_lobes_[k].point != nowhere} << (k % 64);
  }
  if (none(rough)) return;
  sum_tints();
  std::array<Block, in_row * in_row> found;
  for (std::size_t b = 0; b < found.size(); ++b) {
    const std::size_t word = b / in_row, column = b % in_row * side;
    std::uint64_t left = rough[word] & block4 << column;
    while (left != 0) {
      std::uint64_t members = 0;
      const auto number_of = [&](std::uint64_t pixels) {
        return word * 64 + static_cast<std::size_t>(std::countr_zero(pixels));
      };
      const std::uint32_t surface = receivers_.surface[number_of(left)];
      for (std::uint64_t rest = left; rest != 0; rest &= rest - 1) {
        if (receivers_.surface[number_of(rest)] == surface) members |= rest & -rest;
      }
      // In the middle of the block, if one of them is.
      const std::uint64_t middle = members & (std::uint64_t{0x0000'0006'0006'0000} << column);
      const OpenLobe lobe = open_lobe(number_of(middle != 0 ? middle : members), word, members);
      found[b].surfaces[found[b].count++] = {surface, lobe};
      left &= ~members;
    }
  }
  for (std::size_t k = 0; k < cell_pixels; ++k) {
    if (!in(rough, k)) continue;
    const std::uint32_t surface = receivers_.surface[k];
    // Between the middles of four blocks, or as the outermost ones.
    const auto place = [](std::size_t pixel) {
      const float at = (static_cast<float>(pixel) - (side - 1) / 2.0F) / side;
      return std::clamp(at, 0.0F, in_row - 1.0F);
    };
    const float x = place(k % cell_size), y = place(k / cell_size);
    const auto left = static_cast<std::size_t>(x), top = static_cast<std::size_t>(y);
    OpenLobe sum{0, 0};
    float weights = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t column = left + i % 2, row = top + i / 2;
      const float weight = (1 - std::abs(x - static_cast<float>(column))) *
                           (1 - std::abs(y - static_cast<float>(row)));
      if (!(weight > 0)) continue;
      const Block& block = found[row * in_row + column];
      for (const OfBlock& of : std::span(block.surfaces).first(block.count)) {
        if (of.surface != surface || !(of.lobe.lights > 0)) continue;
        sum.share += weight * of.lobe.share, sum.lights += weight * of.lobe.lights;
        weights += weight;
      }
    }
    if (weights > 0) open_lobes_[k] = {sum.share / weights, sum.lights / weights};
  }
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
    const OpenLobe lobe = is_known ? open_lobes_[pixel] : OpenLobe{};
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
