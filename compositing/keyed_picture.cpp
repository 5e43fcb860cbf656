// Keyed frames.
#include "compositing/keyed_picture.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <stdexcept>
#include <utility>

#include "capture/half.h"

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

float aspect_of(const KeyedTexture& texture) {
  return static_cast<float>(texture.height()) / static_cast<float>(texture.width());
}

// share_inside(), at once where it is all: its square reaches half a side, times the root of a
// picture's aspect.
float inside_of(float u, float v, float footprint_uv, float aspect) {
  const float edge = 2 * footprint_uv;
  const bool whole = edge >= 0 && u >= edge && u <= 1 - edge && v >= edge && v <= 1 - edge &&
                     aspect > 0.0625F && aspect < 16;
  return whole ? 1.0F : share_inside(u, v, footprint_uv, aspect);
}

void check_frame(const std::shared_ptr<const KeyedTexture>& texture) {
  if (!texture || texture->empty()) {
    throw std::invalid_argument("a keyed picture needs a frame");
  }
}

}  // namespace

KeyedPicture::KeyedPicture(std::shared_ptr<const KeyedTexture> texture, bool bounded)
    : texture_(std::move(texture)) {
  check_frame(texture_);
  side_texels_ =
      std::sqrt(static_cast<float>(texture_->width()) * static_cast<float>(texture_->height()));
  aspect_ = aspect_of(*texture_);
  if (!bounded) return;
  const capture::HalfImage& image = texture_->level(0);
  Bounds level{image.width, image.height, {}};
  level.most.assign(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height),
                    255);
  for (std::size_t i = 0; i < level.most.size(); ++i) {
    const float alpha = std::clamp(capture::float_from_half(image.pixels[4 * i + 3]), 0.0F, 1.0F);
    level.most[i] = static_cast<std::uint8_t>(std::ceil(alpha * 255));
  }
  bounds_.push_back(std::move(level));
  while (bounds_.back().width > 1 || bounds_.back().height > 1) {
    const Bounds& fine = bounds_.back();
    Bounds coarse{(fine.width + 1) / 2, (fine.height + 1) / 2, {}};
    coarse.most.assign(
        static_cast<std::size_t>(coarse.width) * static_cast<std::size_t>(coarse.height), 0);
    for (int y = 0; y < fine.height; ++y) {
      for (int x = 0; x < fine.width; ++x) {
        std::uint8_t& most = coarse.most[static_cast<std::size_t>(y / 2 * coarse.width + x / 2)];
        most = std::max(most, fine.most[static_cast<std::size_t>(y * fine.width + x)]);
      }
    }
    bounds_.push_back(std::move(coarse));
  }
}

float KeyedPicture::most_alpha(float u0, float v0, float u1, float v1) const {
  if (bounds_.empty()) return 1;
  // Interpolation reaches a texel further.
  const auto texel = [](float place, int size, int further) {
    const float at = std::clamp(place, 0.0F, 1.0F) * static_cast<float>(size);
    return std::clamp(static_cast<int>(at) + further, 0, size - 1);
  };
  if (!(u1 >= u0 && v1 >= v0)) return 1;
  const int width = bounds_[0].width, height = bounds_[0].height;
  const int x0 = texel(u0, width, -1), x1 = texel(u1, width, 1);
  const int y0 = texel(v0, height, -1), y1 = texel(v1, height, 1);
  const auto longest = static_cast<unsigned>(std::max(x1 - x0, y1 - y0));
  std::size_t k = longest > 1 ? static_cast<std::size_t>(std::bit_width(longest)) - 1 : 0;
  while ((x1 >> k) - (x0 >> k) > 1 || (y1 >> k) - (y0 >> k) > 1) ++k;
  const Bounds& level = bounds_[k];
  std::uint8_t most = 0;
  for (int y = y0 >> k; y <= y1 >> k; ++y) {
    for (int x = x0 >> k; x <= x1 >> k; ++x) {
      most = std::max(most, level.most[static_cast<std::size_t>(y * level.width + x)]);
    }
  }
  return static_cast<float>(most) / 255;
}

float KeyedPicture::quick_alpha(float u, float v, float footprint_uv) const {
  const float inside = inside_of(u, v, footprint_uv, aspect_);
  if (!(inside > 0)) return 0;
  // The level whose texels are half to all of the width.
  const float texels = std::min(footprint_uv * side_texels_, 1e6F);
  std::size_t k = 0;
  if (texels >= 2) k = static_cast<std::size_t>(std::bit_width(static_cast<unsigned>(texels))) - 1;
  const capture::HalfImage& level = texture_->level(std::min(k, texture_->levels() - 1));
  const auto last_x = static_cast<float>(level.width - 1);
  const auto last_y = static_cast<float>(level.height - 1);
  const float x = std::clamp(u * static_cast<float>(level.width) - 0.5F, 0.0F, last_x);
  const float y = std::clamp(v * static_cast<float>(level.height) - 0.5F, 0.0F, last_y);
  const auto x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  const std::size_t right = x0 + 1 < level.width ? 4 : 0;
  const auto alpha = [](const capture::Half* at) { return capture::float_from_half(*at); };
  const capture::Half* upper = &level.pixels[level.index(y0, x0)] + 3;
  const capture::Half* lower =
      &level.pixels[level.index(std::min(y0 + 1, level.height - 1), x0)] + 3;
  const float above = alpha(upper) + fx * (alpha(upper + right) - alpha(upper));
  const float below = alpha(lower) + fx * (alpha(lower + right) - alpha(lower));
  return std::clamp((above + fy * (below - above)) * inside, 0.0F, 1.0F);
}

std::array<float, 4> KeyedPicture::look_up(float u, float v, float footprint_uv) const {
  if (texture_->is_clear(u, v, footprint_uv)) return {};
  const float inside = inside_of(u, v, footprint_uv, aspect_);
  if (!(inside > 0)) return {};
  std::array<float, 4> rgba = texture_->filtered(u, v, footprint_uv);
  for (float& value : rgba) value = std::max(value * inside, 0.0F);
  rgba[3] = std::min(rgba[3], 1.0F);
  return rgba;
}

TexelKeyedPicture::TexelKeyedPicture(std::shared_ptr<const KeyedTexture> texture,
                                     std::shared_ptr<const LitPlate> plate,
                                     std::shared_ptr<const FilteredPlate> filtered,
                                     const KeyDials& dials)
    : texture_(std::move(texture)),
      plate_(std::move(plate)),
      filtered_(std::move(filtered)),
      dials_(dials) {
  check_frame(texture_);
  if (!plate_ || !filtered_ || texture_->width() != plate_->width ||
      texture_->height() != plate_->height) {
    throw std::invalid_argument("a frame that is keyed by its texels must be of its plate's size");
  }
  aspect_ = aspect_of(*texture_);
}

KeyPlace TexelKeyedPicture::place_of(const render::PicturePlace& at) const {
  const auto texel = [](float place, int size) {
    return std::clamp(static_cast<int>(place * static_cast<float>(size)), 0, size - 1);
  };
  const std::array<float, 4> light = texture_->filtered(at.u, at.v, at.footprint_uv);
  const int y = texel(at.v, plate_->height), x = texel(at.u, plate_->width);
  const float* const nearest = plate_->cell(y / plate_->step, x / plate_->step);
  return {y,
          x,
          {light[0], light[1], light[2]},
          filtered_->at(*plate_, nearest, at.u, at.v, at.footprint_uv)};
}

std::array<float, 4> TexelKeyedPicture::look_up(float u, float v, float footprint_uv) const {
  const float inside = inside_of(u, v, footprint_uv, aspect_);
  if (!(inside > 0)) return {};
  std::array<float, 4> rgba = key_texel(*plate_, dials_, place_of({u, v, footprint_uv}));
  for (float& value : rgba) value *= inside;
  return rgba;
}

void TexelKeyedPicture::look_up_all(std::span<const render::PicturePlace> places,
                                    std::span<std::array<float, 4>> rgba) const {
  std::array<KeyPlace, key_lanes> eight;
  std::array<std::array<float, 4>, key_lanes> keyed;
  std::array<std::size_t, key_lanes> from;
  std::array<float, key_lanes> inside;
  std::size_t count = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    rgba[i] = {};
    const auto& [u, v, footprint_uv] = places[i];
    inside[count] = inside_of(u, v, footprint_uv, aspect_);
    if (inside[count] > 0) {
      from[count] = i;
      eight[count++] = place_of(places[i]);
    }
    if (count < eight.size() && i + 1 < places.size()) continue;
    key_texels(*plate_, dials_, std::span(eight).first(count), keyed);
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t c = 0; c < 4; ++c) rgba[from[k]][c] = keyed[k][c] * inside[k];
    }
    count = 0;
  }
}

}  // namespace compositing
