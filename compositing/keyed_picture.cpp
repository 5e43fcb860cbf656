// Keyed frames.
#include "compositing/keyed_picture.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>
#include <utility>

namespace compositing {
namespace {

// Of a stretch of width w about x, that lies in 0..1.
float inside(float x, float w) {
  if (!(w > 0)) return x >= 0 && x <= 1 ? 1.0F : 0.0F;  // nor where x is no number
  const float part = std::min(x + w / 2, 1.0F) - std::max(x - w / 2, 0.0F);
  return std::clamp(part / w, 0.0F, 1.0F);
}

}  // namespace

float share_inside(float u, float v, float footprint_uv, float aspect) {
  const float root = std::sqrt(aspect);
  return inside(u, footprint_uv * root) * inside(v, footprint_uv / root);
}

namespace {

float aspect_of(const render::VideoTexture& texture) {
  return static_cast<float>(texture.height()) / static_cast<float>(texture.width());
}

void check_frame(const std::shared_ptr<const render::VideoTexture>& texture) {
  if (!texture || texture->levels.empty() || texture->levels.front().empty()) {
    throw std::invalid_argument("a keyed picture needs a frame");
  }
}

// Of 3 channels, the fourth is the share of the picture.
std::array<float, 4> filtered(const render::VideoTexture& texture,
                              float u,
                              float v,
                              float footprint_uv) {
  std::array<float, 4> sum{};
  std::array<render::VideoSample, render::most_video_samples> places;
  const std::size_t count =
      render::find_video_samples(texture.width(), texture.height(), u, v, footprint_uv, 0, places);
  for (const render::VideoSample& place : std::span(places).first(count)) {
    const capture::Image& level = texture.levels[place.level];
    const auto channels = static_cast<std::size_t>(level.channels);
    const float x = std::clamp(place.x, 0.0F, static_cast<float>(level.width - 1));
    const float y = std::clamp(place.y, 0.0F, static_cast<float>(level.height - 1));
    const auto x0 = static_cast<int>(x), y0 = static_cast<int>(y);
    const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
    const int x1 = std::min(x0 + 1, level.width - 1), y1 = std::min(y0 + 1, level.height - 1);
    const auto add = [&](int column, int row, float weight) {
      const float* texel = &level.pixels[level.index(row, column)];
      for (std::size_t c = 0; c < channels; ++c) sum[c] += weight * texel[c];
      if (channels == 3) sum[3] += weight;
    };
    add(x0, y0, place.share * (1 - fx) * (1 - fy));
    add(x1, y0, place.share * fx * (1 - fy));
    add(x0, y1, place.share * (1 - fx) * fy);
    add(x1, y1, place.share * fx * fy);
  }
  return sum;
}

}  // namespace

KeyedPicture::KeyedPicture(std::shared_ptr<const render::VideoTexture> texture)
    : texture_(std::move(texture)) {
  check_frame(texture_);
}

std::array<float, 4> KeyedPicture::look_up(float u, float v, float footprint_uv) const {
  const float inside = share_inside(u, v, footprint_uv, aspect_of(*texture_));
  if (!(inside > 0)) return {};
  std::array<float, 4> rgba = filtered(*texture_, u, v, footprint_uv);
  for (float& value : rgba) value = std::max(value * inside, 0.0F);
  rgba[3] = std::min(rgba[3], 1.0F);
  return rgba;
}

TexelKeyedPicture::TexelKeyedPicture(std::shared_ptr<const render::VideoTexture> texture,
                                     LitPlate plate,
                                     const KeyDials& dials)
    : texture_(std::move(texture)), plate_(std::move(plate)), dials_(dials) {
  check_frame(texture_);
  if (texture_->levels.front().channels != 3 || texture_->width() != plate_.width ||
      texture_->height() != plate_.height) {
    throw std::invalid_argument("a frame that is keyed by its texels must be of its plate's size");
  }
}

std::array<float, 4> TexelKeyedPicture::look_up(float u, float v, float footprint_uv) const {
  const float inside = share_inside(u, v, footprint_uv, aspect_of(*texture_));
  if (!(inside > 0)) return {};
  const std::array<float, 4> light = filtered(*texture_, u, v, footprint_uv);
  const auto texel = [](float place, int size) {
    return std::clamp(static_cast<int>(place * static_cast<float>(size)), 0, size - 1);
  };
  std::array<float, 4> rgba = key_texel(plate_, dials_, texel(v, plate_.height),
                                        texel(u, plate_.width), {light[0], light[1], light[2]});
  for (float& value : rgba) value *= inside;
  return rgba;
}

}  // namespace compositing
