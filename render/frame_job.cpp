// Jobs as bytes.
#include "render/frame_job.h"

namespace render {

RenderStatistics& RenderStatistics::operator+=(const RenderStatistics& o) {
  primary_rays += o.primary_rays;
  shadow_rays += o.shadow_rays;
  secondary_rays += o.secondary_rays;
  depth_limit_hits += o.depth_limit_hits;
  clamped_values += o.clamped_values;
  clipped_plate += o.clipped_plate;
  virtual_pixels += o.virtual_pixels;
  affected_pixels += o.affected_pixels;
  return *this;
}

}  // namespace render
