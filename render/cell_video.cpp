// Live textures of a cell: what shows them, and where.
#include "render/cell_baker.h"

namespace render {

// Calls `call` with the places that a look-up of a live texture finds, and their level in the
// frame's.
template <class F>
void CellBaker::for_each_place(const SeenVideo& seen, F&& call) const {
  const auto index = static_cast<std::size_t>(seen.index);
  const VideoTexture& video = *frame_->inputs.videos[index];
  std::array<VideoSample, most_video_samples> places;
  const std::size_t count = find_video_samples(video.width(), video.height(), seen.u, seen.v,
                                               seen.footprint, seen.blur_uv, places);
  for (const VideoSample& place : std::span(places).first(count)) {
    call(place, static_cast<std::uint16_t>(frame_->first_video_levels[index] + place.level));
  }
}

void CellBaker::add_video(const ShadePoint& p) {
  const Vec3f weight = p.throughput * p.video_gain;
  samples_[p.slot].added += weight * planned_grey;
  const auto slot = static_cast<std::uint16_t>(target_of(p));
  for_each_place(p.video, [&](const VideoSample& place, std::uint16_t level) {
    video_.add({weight * place.share, place.x, place.y, slot, level});
  });
}

// The light of a matte surface whose colour is a live texture gets a slot of its own. Where a pixel
// has many such points, several have one together: their light then has the mean of their colours.
void CellBaker::paint(ShadePoint& p) {
  const float weight = largest(p.throughput * p.diffuse);
  if (p.paint.index < 0 || !(weight > 0)) return;
  if (shades_ring_) {  // of which nothing is kept
    p.painted = 0;
    return;
  }
  PaintedSlot* const own = painted_slot(p);
  if (own == nullptr) {
    p.diffuse = p.diffuse * planned_grey;
    return;
  }
  p.painted = own->number;
  own->weight += weight;
  for_each_place(p.paint, [&](const VideoSample& place, std::uint16_t level) {
    const float share = weight * place.share;
    paint_.add({{share, share, share}, place.x, place.y, own->number, level});
  });
}

// Null where a pixel has no slot left, and none that is of the same kind.
CellBaker::PaintedSlot* CellBaker::painted_slot(const ShadePoint& p) {
  constexpr std::size_t enough = 4;  // of the same kind
  PaintedOfPixel& own = painted_of_pixel_[p.pixel];
  std::uint8_t& taken = painted_count_[p.pixel];
  const auto slot = static_cast<std::uint16_t>(target_of(p));
  const auto video = static_cast<std::uint16_t>(p.paint.index);
  std::array<PaintedSlot*, CellTransport::most_painted_of_pixel> alike;
  std::size_t count = 0;
  for (PaintedSlot& other : std::span(own).first(taken)) {
    if (other.slot == slot && other.video == video) alike[count++] = &other;
  }
  if (count < enough && taken < own.size()) {
    std::vector<CellTransport::Painted>& painted = transport_->painted;
    PaintedSlot& added = own[taken++];
    added = {static_cast<std::uint16_t>(painted.size()), slot, video, 0};
    painted.push_back({0, 0, slot});
    return &added;
  }
  return count > 0 ? alike[painted_turn_[p.pixel]++ % count] : nullptr;
}

void CellBaker::add_painted_centre(const ShadePoint& p) {
  transport_->shared.push_back({matte_target_of(p), static_cast<std::uint16_t>(p.pixel),
                                CellTransport::SharedTerm::Of::light, p.throughput * p.diffuse});
  painted_diffuse_[p.pixel] = p.throughput * planned_diffuse(p);
}

}  // namespace render
