// Billboards with which cells are found, as with other things: for tests.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "compositing/billboard.h"
#include "render/shader.h"

namespace compositing {

// The shader of billboards, but for whom cells are found with their pictures.
class FoundWith final : public render::Shader {
 public:
  explicit FoundWith(std::shared_ptr<const render::Shader> billboard)
      : billboard_(std::move(billboard)) {}
  void check(const render::SceneDescription& scene, const render::Material& m) const override {
    billboard_->check(scene, m);
  }
  void shade(const render::ShadeContext& context,
             std::span<render::ShadePoint* const> points,
             render::RaySink& rays) const override {
    billboard_->shade(context, points, rays);
  }
  bool lets_light_through(const render::Material&) const override { return true; }
  bool glows_by_means() const override { return true; }
  std::vector<std::size_t> pictures_of(const render::Material& m) const override {
    return billboard_->pictures_of(m);
  }
  render::Vec3f transmittance(const render::ShadeContext& context,
                              const render::Material& m,
                              const render::HitPoint& hit,
                              render::Vec3f incoming,
                              render::RayKind kind,
                              float footprint_m) const override {
    return billboard_->transmittance(context, m, hit, incoming, kind, footprint_m);
  }

 private:
  std::shared_ptr<const render::Shader> billboard_;
};

// As the shader "found_with".
inline void register_found_with() {
  render::register_shader("found_with",
                          std::make_shared<FoundWith>(render::find_shader("billboard")));
}

}  // namespace compositing
