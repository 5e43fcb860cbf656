// Pictures that change from frame to frame and decide what rays see: persons, keyed.
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace render {

// Where a picture is looked at, and how wide, as look_up() has it.
struct PicturePlace {
  float u, v;
  float footprint_uv;
};

// One frame of it. Immutable while frames are rendered that see it; many threads look at once.
class LivePicture {
 public:
  virtual ~LivePicture() = default;
  // Premultiplied scene-linear red, green, blue, at least 0, and alpha, 0 to 1, at (u, v), 0..1
  // from the picture's top left: the mean of a square that is footprint_uv squared of the picture's
  // area. Beyond the picture there is nothing; nor is there where numbers are not finite.
  virtual std::array<float, 4> look_up(float u, float v, float footprint_uv) const = 0;
  // look_up() at many places, of which `rgba` is as long: for pictures that take long over one.
  virtual void look_up_all(std::span<const PicturePlace> places,
                           std::span<std::array<float, 4>> rgba) const {
    for (std::size_t i = 0; i < places.size(); ++i)
      rgba[i] = look_up(places[i].u, places[i].v, places[i].footprint_uv);
  }
  // The alpha of look_up(), or of one about as wide where that is quicker to find.
  virtual float quick_alpha(float u, float v, float footprint_uv) const {
    return look_up(u, v, footprint_uv)[3];
  }
  // Whether look_up() has nothing at all here: said only where that is quick to tell.
  virtual bool is_clear(float u, float v, float footprint_uv) const {
    static_cast<void>(u), static_cast<void>(v), static_cast<void>(footprint_uv);
    return false;
  }
  // Whether look_up() has nothing anywhere: said only where that is quick to tell.
  virtual bool shows_nothing() const { return false; }
  // What no alpha in the rectangle from (u0, v0) to (u1, v1) exceeds, whatever the footprint of a
  // look-up whose square, widened three times, lies in it. 1 where it would take long to say.
  virtual float most_alpha(float u0, float v0, float u1, float v1) const {
    static_cast<void>(u0), static_cast<void>(v0), static_cast<void>(u1), static_cast<void>(v1);
    return 1;
  }
};

}  // namespace render
