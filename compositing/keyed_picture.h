// A keyed frame as a live picture, filtered by mip levels.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "compositing/filtered_plate.h"
#include "compositing/keyed_texture.h"
#include "compositing/keyer.h"
#include "render/live_picture.h"

namespace compositing {

// Of premultiplied foreground and alpha: keyed first, then filtered.
class KeyedPicture final : public render::LivePicture {
 public:
  // `bounded`: most_alpha() says more than 1, which hulls (visual_hull.h) are quick by; takes about
  // a byte a texel. Throws std::invalid_argument if there is no texture or it is empty.
  explicit KeyedPicture(std::shared_ptr<const KeyedTexture> texture, bool bounded = false);

  std::array<float, 4> look_up(float u, float v, float footprint_uv) const override;
  bool is_clear(float u, float v, float footprint_uv) const override {
    return texture_->is_clear(u, v, footprint_uv);
  }
  bool shows_nothing() const override { return texture_->is_bare(); }
  // Bilinear in one level.
  float quick_alpha(float u, float v, float footprint_uv) const override;
  float most_alpha(float u0, float v0, float u1, float v1) const override;

 private:
  // The largest alpha of 2^k by 2^k texels, in 255ths rounded up.
  struct Bounds {
    int width = 0, height = 0;
    std::vector<std::uint8_t> most;
  };

  std::shared_ptr<const KeyedTexture> texture_;
  std::vector<Bounds> bounds_;  // by k
  float side_texels_ = 0;       // of a square of as many texels
  float aspect_ = 0;            // height over width
};

// The same of a frame that is not keyed yet: filtered first, then keyed once. For persons that few
// rays see; their alpha is not smoothed over frames.
class TexelKeyedPicture final : public render::LivePicture {
 public:
  // Plates and dials as the keyer has them for this frame (Keyer::shared_lit, shared_filtered,
  // dials); what the dials point to must outlive the picture. Throws std::invalid_argument if there
  // is no texture or plate, or its size is not the plate's.
  TexelKeyedPicture(std::shared_ptr<const KeyedTexture> texture,
                    std::shared_ptr<const LitPlate> plate,
                    std::shared_ptr<const FilteredPlate> filtered,
                    const KeyDials& dials);

  std::array<float, 4> look_up(float u, float v, float footprint_uv) const override;
  // Keyed eight at a time.
  void look_up_all(std::span<const render::PicturePlace> places,
                   std::span<std::array<float, 4>> rgba) const override;

 private:
  KeyPlace place_of(const render::PicturePlace& at) const;

  std::shared_ptr<const KeyedTexture> texture_;
  std::shared_ptr<const LitPlate> plate_;
  std::shared_ptr<const FilteredPlate> filtered_;
  KeyDials dials_;
  float aspect_ = 0;  // height over width
};

// Share that lies in the picture, of the square of look_up(). `aspect` is its height over width.
float share_inside(float u, float v, float footprint_uv, float aspect);

}  // namespace compositing
