// Rays that pictures let pass straight on. Private to the kernel.
#pragma once

#include <array>

#include "render/light_gather.h"
#include "render/shader.h"

namespace render {

// Pictures behind each other that are looked at; the last one hides nothing.
inline constexpr int most_pictures = 16;
// Less of a pixel than that is not looked for behind a picture.
inline constexpr float least_share = 1.0F / 512;

// What surfaces send on, where that is one ray straight through each: else there is no foreground.
class StraightOn final : public RaySink {
 public:
  explicit StraightOn(const ShadePoint* points) : points_(points) { share_.fill({}); }
  void push(const ShadePoint& from, const NewRay& ray) override {
    const auto i = static_cast<std::size_t>(&from - points_);
    broken_ = broken_ || ray.normal != Vec3f{} || ray.kind != RayKind::camera || ray.media ||
              share_[i] != Vec3f{};
    origin_[i] = ray.origin;
    share_[i] = ray.throughput;
  }
  bool broken() const { return broken_; }
  Vec3f origin(std::size_t i) const { return origin_[i]; }
  Vec3f share(std::size_t i) const { return share_[i]; }

 private:
  const ShadePoint* points_;
  std::array<Vec3f, stream_rays> origin_, share_;
  bool broken_ = false;
};

}  // namespace render
