// Environments as bytes.
#include "render/environment_bytes.h"

#include <algorithm>
#include <vector>

#include "render/bytes.h"

namespace render {
namespace {

constexpr std::uint32_t environment_magic = 0x344E4550;  // "PEN4"

void put(ByteWriter& out, const capture::Image& image) {
  out.put(image.height), out.put(image.width), out.put(image.channels);
  out.put_all(image.pixels);
}

capture::Image get_image(ByteReader& in) {
  capture::Image image;
  in.get(image.height), in.get(image.width), in.get(image.channels);
  in.get_all(image.pixels);
  constexpr int limit = 1 << 15;
  if (image.height < 1 || image.width < 1 || image.channels != 3 || image.height > limit ||
      image.width > limit ||
      image.pixels.size() !=
          static_cast<std::size_t>(image.height) * static_cast<std::size_t>(image.width) * 3) {
    in.fail("holds a map of another size than it says");
  }
  return image;
}

}  // namespace

std::vector<std::byte> serialize(const Environment& environment) {
  ByteWriter out;
  out.put(environment_magic);
  put(out, environment.radiance);
  out.put_all(environment.seen);
  out.put(environment.unseen_share);
  out.put(environment.compact_apart);
  for (const auto* levels : {&environment.smoothed, &environment.halved, &environment.diffused}) {
    out.put(static_cast<std::uint64_t>(levels->size()));
    for (const capture::Image& level : *levels) put(out, level);
  }
  return out.take();
}

Environment parse_environment(std::span<const std::byte> bytes) {
  ByteReader in(bytes, "environment");
  if (in.get<std::uint32_t>() != environment_magic) in.fail("is of another kind or version");
  Environment environment;
  environment.radiance = get_image(in);
  in.get_all(environment.seen);
  in.get(environment.unseen_share);
  in.get(environment.compact_apart);
  const std::size_t texels = environment.radiance.pixels.size() / 3;
  if (!environment.seen.empty() && environment.seen.size() != texels) {
    in.fail("has a coverage of another size than its map");
  }
  for (auto* levels : {&environment.smoothed, &environment.halved, &environment.diffused}) {
    for (std::size_t n = in.get_count(3 * sizeof(int) + sizeof(std::uint64_t)); n > 0; --n) {
      levels->push_back(get_image(in));
    }
  }
  in.expect_end();
  // Places are found by the sizes of the one and looked up in the other.
  if (!environment.diffused.empty()) {
    if (environment.smoothed.empty()) in.fail("has diffused levels alone");
    std::vector<int> heights{environment.smoothed[0].height};
    for (const capture::Image& level : environment.halved) heights.push_back(level.height);
    if (!std::ranges::equal(environment.diffused, heights, {}, &capture::Image::height)) {
      in.fail("has diffused levels of other sizes than its own");
    }
  }
  return environment;
}

}  // namespace render
