// Live pictures that the camera sees before everything else, each pixel's own where blocks of
// pixels share what is behind: persons stay sharp while a picture is coarse.
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "render/cell_baker.h"
#include "render/embree_context.h"
#include "render/straight_on.h"

namespace render {
namespace {

bool only_glows(const ShadePoint& p) {
  return p.video.index < 0 && p.diffuse == Vec3f{} && p.plate_share == Vec3f{} &&
         p.environment_share == Vec3f{} && !p.catches_shadow && !p.catches_lamps;
}

}  // namespace

// Whether a ray through any of the cell's pixels may meet what shows live pictures.
bool CellBaker::may_see_pictures() const {
  const Scene::Places& places = frame_->inputs.scene->places();
  std::optional<CellCone> cone;
  for (std::size_t i = 0; i < places.bounds.size(); ++i) {
    if (places.pictures[i].empty()) continue;
    if (!cone) cone = cone_of_cell(*frame_, x0_, y0_);
    if (may_be_seen(*cone, frame_->camera, places.bounds[i])) return true;
  }
  return false;
}

// Sets a ray through each of the cell's pixels that are in the picture.
void CellBaker::set_rays_of_all_pixels(const CellTransport::Blocks& in_picture) {
  const auto& table = *frame_->inputs.directions;
  for (int i = 0; i < cell_pixels; ++i) {
    const auto [x, y] = pixel_of_ray(i);
    Vec3f v_cam{};
    if (x < in_picture.columns && y < in_picture.rows) {
      const std::size_t t = table.index(y0_ + y, x0_ + x);
      v_cam = {table.x[t], table.y[t], table.z[t]};
    }
    set_camera_ray(i, v_cam);
  }
  turn_camera_rays(cell_pixels);
}

// Traces the stream's rays that are left, which come `came_m` far already, and gathers points where
// they meet pictures; other rays have come to what blocks share. Returns how many points there are;
// `ray_of_point` tells whose they are.
int CellBaker::meet_pictures(std::span<const float, cell_pixels> came_m,
                             std::span<const Vec3f, cell_pixels> left,
                             std::span<int, cell_pixels> ray_of_point) {
  const Scene& scene = *frame_->inputs.scene;
  for (int i = 0; i < cell_pixels; ++i) {
    const auto [x, y] = pixel_of_ray(i);
    const unsigned taken = stream_.mask[static_cast<std::size_t>(i)] != 0;
    statistics_->primary_rays += taken;
    if (counting_) counting_[y * cell_size + x].rays += taken;
  }
  trace(cell_pixels, true, RayKind::camera, frame_->pixel_angle);
  int count = 0;
  for (int k = 0; k < cell_pixels; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (stream_.mask[i] == 0) continue;
    if (stream_.geom[i] == RTC_INVALID_GEOMETRY_ID ||
        !scene.shows_pictures(
            scene.surface_of(stream_.geom[i], stream_.prim[i], stream_.inst[i]).instance)) {
      stream_.mask[i] = 0;
      continue;
    }
    const auto [x, y] = pixel_of_ray(k);
    const auto pixel = static_cast<std::uint32_t>(y * cell_size + x);
    stream_.far_m[i] += came_m[i];
    ShadePoint& p = points_[static_cast<std::size_t>(count)];
    set_point(p, k, pixel, pixel);
    set_camera_cone(p, k, 1);
    p.throughput = left[i];
    clear_answer(p);
    ray_of_point[static_cast<std::size_t>(count++)] = k;
  }
  return count;
}

// Looks at the pictures before everything else, pixel by pixel. Where there are any, the blocks'
// rays are to pass them.
void CellBaker::see_foreground() {
  const Scene& scene = *frame_->inputs.scene;
  if (block_ == 1 || scene.pictures().empty() || !may_see_pictures()) return;
  set_rays_of_all_pixels(transport_->blocks);
  const ShadeContext context{&scene.description(), &scene, scene.pictures(), scene.prepared(),
                             TextureFilter::quick};
  std::array<Vec3f, cell_pixels> radiance{}, left;  // by ray
  std::array<float, cell_pixels> came_m{};
  left.fill({1, 1, 1});
  std::array<int, cell_pixels> ray_of_point;
  bool any = false;
  for (int n = 0; n < most_pictures; ++n) {
    const int count = meet_pictures(came_m, left, ray_of_point);
    if (count == 0) break;
    any = true;
    StraightOn beyond(points_.data());
    for_each_shader(count, [&](const Shader& shader, std::span<ShadePoint* const> group_points) {
      shader.shade(context, group_points, beyond);
    });
    for (std::size_t j = 0; j < static_cast<std::size_t>(count); ++j) {
      const ShadePoint& p = points_[j];
      if (beyond.broken() || !only_glows(p)) return;
      const auto i = static_cast<std::size_t>(ray_of_point[j]);
      radiance[i] += p.throughput * p.radiance;
      left[i] = beyond.share(j);
      came_m[i] = stream_.far_m[i];
      const Vec3f from = beyond.origin(j);
      stream_.ox[i] = from.x, stream_.oy[i] = from.y, stream_.oz[i] = from.z;
      if (largest(left[i]) < least_share) stream_.mask[i] = 0;
    }
  }
  if (!any) return;
  CellTransport::Foreground& foreground = transport_->foreground.emplace_back();
  for (int i = 0; i < cell_pixels; ++i) {
    const auto [x, y] = pixel_of_ray(i);
    const auto k = static_cast<std::size_t>(y * cell_size + x), ray = static_cast<std::size_t>(i);
    const Vec3f passed = left[ray];
    foreground.radiance[k] = four_of(radiance[ray]);
    foreground.passed[k] = Four{passed.x, passed.y, passed.z, mean(passed)};
  }
}

// Whether nothing is seen of what the pixels share that a pixel's ray stands for.
bool CellBaker::is_behind_foreground(int x, int y) const {
  const CellTransport::Foreground& foreground = transport_->foreground.front();
  const CellTransport::Blocks& blocks = transport_->blocks;
  const int left = x - x % blocks.size, top = y - y % blocks.size;
  for (int row = top; row < std::min(top + blocks.size, blocks.rows); ++row) {
    for (int column = left; column < std::min(left + blocks.size, blocks.columns); ++column) {
      if (foreground.passed[static_cast<std::size_t>(row * cell_size + column)][3] > 0)
        return false;
    }
  }
  return true;
}

}  // namespace render
