// Windows of live pictures.
#include "compositing/picture_window.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace compositing {
namespace {

class PartOfPicture final : public render::LivePicture {
 public:
  PartOfPicture(const Window& window, std::shared_ptr<const render::LivePicture> picture)
      : window_(window),
        width_(window.right - window.left),
        height_(window.bottom - window.top),
        side_(std::sqrt(width_ * height_)),
        picture_(std::move(picture)) {}

  std::array<float, 4> look_up(float u, float v, float footprint_uv) const override {
    return picture_->look_up(across(u), down(v), footprint_uv * side_);
  }
  void look_up_all(std::span<const render::PicturePlace> places,
                   std::span<std::array<float, 4>> rgba) const override {
    std::array<render::PicturePlace, 32> part;
    for (std::size_t first = 0; first < places.size(); first += part.size()) {
      const auto some = places.subspan(first, std::min(part.size(), places.size() - first));
      std::ranges::transform(some, part.begin(), [&](const render::PicturePlace& p) {
        return render::PicturePlace{across(p.u), down(p.v), p.footprint_uv * side_};
      });
      picture_->look_up_all(std::span(part).first(some.size()), rgba.subspan(first, some.size()));
    }
  }
  float quick_alpha(float u, float v, float footprint_uv) const override {
    return picture_->quick_alpha(across(u), down(v), footprint_uv * side_);
  }
  bool is_clear(float u, float v, float footprint_uv) const override {
    return picture_->is_clear(across(u), down(v), footprint_uv * side_);
  }
  bool shows_nothing() const override { return picture_->shows_nothing(); }
  float most_alpha(float u0, float v0, float u1, float v1) const override {
    return picture_->most_alpha(across(u0), down(v0), across(u1), down(v1));
  }

 private:
  float across(float u) const { return window_.left + u * width_; }
  float down(float v) const { return window_.top + v * height_; }

  Window window_;
  float width_, height_;
  float side_;  // of the window, of a picture's of as much area as 1
  std::shared_ptr<const render::LivePicture> picture_;
};

}  // namespace

std::shared_ptr<const render::LivePicture> see_through(
    const Window& window, std::shared_ptr<const render::LivePicture> picture) {
  if (!picture) throw std::invalid_argument("a window needs a picture");
  const bool within = window.left >= 0 && window.right <= 1 && window.left < window.right &&
                      window.top >= 0 && window.bottom <= 1 && window.top < window.bottom;
  if (!within) throw std::invalid_argument("a window must be a part of its picture");
  if (window == Window()) return picture;
  return std::make_shared<PartOfPicture>(window, std::move(picture));
}

}  // namespace compositing
