// A keyed frame with its mip levels, in half floats: what pictures of persons are filtered from.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "capture/image.h"
#include "compositing/keyed_frame.h"

namespace compositing {

// A keyer writes frame(), then finish() makes the levels; or take() does both for a frame that is
// not keyed. From then on it is not changed, and many threads look at once. One that is used again
// keeps its memory, and work: what is bare in both frames is passed over.
class KeyedTexture {
 public:
  KeyedFrame& frame() { return frame_; }
  const KeyedFrame& frame() const { return frame_; }
  void finish();
  // (height, width, 3), opaque, or (height, width, 4), premultiplied; scene-linear. Values that are
  // not finite become 0, those beyond half's range its largest. Throws std::invalid_argument for
  // another number of channels, or a side that is not 1 to render::largest_video_side.
  void take(const capture::Image& frame);

  bool empty() const { return frame_.image().empty(); }
  int width() const { return frame_.image().width; }
  int height() const { return frame_.image().height; }
  // Level k is max(1, width >> k) by max(1, height >> k), down to 1x1; each is the area average of
  // the one before.
  std::size_t levels() const { return 1 + coarser_.size(); }
  const capture::HalfImage& level(std::size_t k) const {
    return k == 0 ? frame_.image() : coarser_[k - 1];
  }

  // Whether filtered() is all 0 everywhere: nobody is there.
  bool is_bare() const { return bare_everywhere_; }
  // Whether it is here: not where the person is near.
  bool is_clear(float u, float v, float footprint_uv) const;
  // Red, green, blue and alpha at (u, v), filtered over a square of `footprint_uv`. A texel counts
  // as the mean of its own square, as a camera's pixel is: up to one texel wide it is interpolated
  // once, so that a person who is seen as filmed is as sharp as filmed. From two texels on, the
  // places are those of render::find_video_samples().
  std::array<float, 4> filtered(float u, float v, float footprint_uv) const;

 private:
  void find_bare();

  KeyedFrame frame_;
  std::vector<capture::HalfImage> coarser_;
  // Of each 8x8 pixels: how many such blocks away the nearest is that is not bare, 0 to 255.
  std::vector<std::uint8_t> bare_;
  bool bare_everywhere_ = false;
};

// One that took a picture.
std::shared_ptr<const KeyedTexture> make_keyed_texture(const capture::Image& frame);

}  // namespace compositing
