// Jobs as bytes.
#include "render/frame_job.h"

#include "render/bytes.h"

namespace render {
namespace {

constexpr std::uint32_t frame_job_magic = 0x414A4650;  // "PFJA"
constexpr std::uint32_t tile_job_magic = 0x314A5450;   // "PTJ1"

// Calls visit on every single number of an Effort, so that writing and reading cannot differ.
template <class E, class F>
void for_each_setting(E& effort, F&& visit) {
  visit(effort.aa_samples), visit(effort.glint_contrast), visit(effort.aa_tolerance),
      visit(effort.light_samples), visit(effort.interleave), visit(effort.bounce_lamps),
      visit(effort.caustic_photons);
  visit(effort.adaptive_visibility), visit(effort.soft_lights), visit(effort.cull_lights),
      visit(effort.accuracy), visit(effort.chance_cuts), visit(effort.dark_cuts);
  visit(effort.max_depth), visit(effort.max_rays), visit(effort.tile_size);
}

template <class R, class F>
void for_each_edge(R& rect, F&& visit) {
  visit(rect.x), visit(rect.y), visit(rect.width), visit(rect.height);
}

void expect_magic(ByteReader& in, std::uint32_t magic) {
  if (in.get<std::uint32_t>() != magic) in.fail("is of another kind or version");
}

}  // namespace

std::vector<std::byte> serialize(const FrameJob& job) {
  ByteWriter out;
  out.put(frame_job_magic);
  out.put(job.frame);
  out.put(job.time.count());
  out.put_all(std::span<const double>(job.cam_from_set.R.m));
  out.put(job.cam_from_set.t.x), out.put(job.cam_from_set.t.y), out.put(job.cam_from_set.t.z);
  out.put(job.lens);
  out.put(job.scene_version);
  for_each_setting(job.effort, [&out](const auto& value) { out.put(value); });
  out.put(static_cast<std::uint64_t>(job.textures.size()));
  for (const TextureTime& texture : job.textures) {
    out.put(texture.stream), out.put(texture.time.count());
  }
  out.put_all(job.lights.lights);
  out.put_all(job.lights.parts);
  out.put_all(job.lights.lamps);
  out.put(job.lights.version);
  out.put(job.lights.unseen_share), out.put(job.lights.error_estimate);
  for (const float value : job.match) out.put(value);
  out.put_all(job.stages);
  for (const float parameter : job.tone) out.put(parameter);
  return out.take();
}

FrameJob parse_frame_job(std::span<const std::byte> bytes) {
  ByteReader in(bytes, "frame job");
  expect_magic(in, frame_job_magic);
  FrameJob job;
  in.get(job.frame);
  job.time = capture::Time(in.get<capture::Time::rep>());
  std::vector<double> rotation;
  in.get_all(rotation);
  if (rotation.size() != job.cam_from_set.R.m.size()) in.fail("has a rotation that is not 3x3");
  std::copy(rotation.begin(), rotation.end(), job.cam_from_set.R.m.begin());
  in.get(job.cam_from_set.t.x), in.get(job.cam_from_set.t.y), in.get(job.cam_from_set.t.z);
  in.get(job.lens);
  in.get(job.scene_version);
  for_each_setting(job.effort, [&in](auto& value) { in.get(value); });
  job.textures.resize(in.get_count(sizeof(std::uint32_t) + sizeof(capture::Time::rep)));
  for (TextureTime& texture : job.textures) {
    in.get(texture.stream);
    texture.time = capture::Time(in.get<capture::Time::rep>());
  }
  in.get_all(job.lights.lights);
  in.get_all(job.lights.parts);
  in.get_all(job.lights.lamps);
  in.get(job.lights.version);
  in.get(job.lights.unseen_share), in.get(job.lights.error_estimate);
  for (float& value : job.match) in.get(value);
  in.get_all(job.stages);
  for (float& parameter : job.tone) in.get(parameter);
  in.expect_end();
  return job;
}

std::vector<std::byte> serialize(const TileJob& tile) {
  ByteWriter out;
  out.put(tile_job_magic);
  for_each_edge(tile.rect, [&out](int value) { out.put(value); });
  out.put(tile.margin);
  for_each_edge(tile.background_rect, [&out](int value) { out.put(value); });
  out.put_all(tile.background);
  return out.take();
}

TileJob parse_tile_job(std::span<const std::byte> bytes) {
  ByteReader in(bytes, "tile job");
  expect_magic(in, tile_job_magic);
  TileJob tile;
  for_each_edge(tile.rect, [&in](int& value) { in.get(value); });
  in.get(tile.margin);
  for_each_edge(tile.background_rect, [&in](int& value) { in.get(value); });
  in.get_all(tile.background);
  in.expect_end();
  const Rect &r = tile.rect, &b = tile.background_rect;
  constexpr int limit = 1 << 15;
  const auto sane = [](const Rect& a) {
    return a.x >= 0 && a.y >= 0 && a.width > 0 && a.height > 0 && a.x < limit && a.y < limit &&
           a.width < limit && a.height < limit;
  };
  if (!sane(r) || !sane(b) || b.x > r.x || b.y > r.y || b.x + b.width < r.x + r.width ||
      b.y + b.height < r.y + r.height) {
    in.fail("has a rectangle that its background does not cover");
  }
  if (tile.background.size() !=
      static_cast<std::size_t>(b.width) * static_cast<std::size_t>(b.height) * 3) {
    in.fail("has a background of another size than it says");
  }
  return tile;
}

RenderStatistics& RenderStatistics::operator+=(const RenderStatistics& o) {
  primary_rays += o.primary_rays;
  shadow_rays += o.shadow_rays;
  secondary_rays += o.secondary_rays;
  kept_rays += o.kept_rays;
  depth_limit_hits += o.depth_limit_hits;
  ray_limit_hits += o.ray_limit_hits;
  clamped_values += o.clamped_values;
  clipped_plate += o.clipped_plate;
  virtual_pixels += o.virtual_pixels;
  affected_pixels += o.affected_pixels;
  return *this;
}

}  // namespace render
