// A keyed frame as a live picture, filtered by mip levels.
#pragma once

#include <memory>

#include "render/live_picture.h"
#include "render/video_texture.h"

namespace compositing {

// Of a texture of premultiplied foreground and alpha: keyed first, then filtered. A texture of 3
// channels is opaque.
class KeyedPicture final : public render::LivePicture {
 public:
  // Throws std::invalid_argument if there is no texture or it is empty.
  explicit KeyedPicture(std::shared_ptr<const render::VideoTexture> texture);

  std::array<float, 4> look_up(float u, float v, float footprint_uv) const override;

 private:
  std::shared_ptr<const render::VideoTexture> texture_;
};

// Share that lies in the picture, of the square of look_up(). `aspect` is its height over width.
float share_inside(float u, float v, float footprint_uv, float aspect);

}  // namespace compositing
