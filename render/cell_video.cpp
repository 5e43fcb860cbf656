// Live textures of a cell: what shows them, and where.
#include "render/cell_baker.h"

namespace render {

void CellBaker::add_video(const ShadePoint& p) {
  const auto index = static_cast<std::size_t>(p.video.index);
  const VideoTexture& video = *frame_->inputs.videos[index];
  const Vec3f weight = p.throughput * p.video.gain;
  samples_[p.slot].added += weight * planned_grey;
  std::array<VideoSample, most_video_samples> places;
  const std::size_t count = find_video_samples(video.width(), video.height(), p.video.u, p.video.v,
                                               p.video.footprint, p.video.blur_uv, places);
  for (std::size_t i = 0; i < count; ++i) {
    const auto& [level, x, y, share] = places[i];
    transport_->video.push_back(
        {weight * share, x, y, static_cast<std::uint16_t>(target_of(p)),
         static_cast<std::uint16_t>(frame_->first_video_levels[index] + level)});
  }
}

}  // namespace render
