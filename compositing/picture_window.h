// A part of a live picture, as a picture of its own.
#pragma once

#include <memory>

#include "render/live_picture.h"

namespace compositing {

// In u and v of the picture, 0..1 from its top left.
struct Window {
  float left = 0, top = 0, right = 1, bottom = 1;

  friend bool operator==(const Window&, const Window&) = default;
};

// What is seen through a window of a picture: for billboards that are no larger than the person.
// Look-ups are the picture's own, also where their squares reach beyond the window. Throws
// std::invalid_argument without a picture, or where the window is empty or not within it.
std::shared_ptr<const render::LivePicture> see_through(
    const Window& window, std::shared_ptr<const render::LivePicture> picture);

}  // namespace compositing
