// Environments as bytes.
#include "render/environment_bytes.h"

#include <algorithm>
#include <stdexcept>
#include <string>
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

// Levels are added up as they are; rounding may pass the brightest by a little.
bool is_counted(float radiance) { return radiance >= 0 && radiance <= 1.01F * brightest_radiance; }

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
  for (const capture::Image* level : levels_of(environment)) {
    if (!std::ranges::all_of(level->pixels, is_counted)) {
      in.fail("holds radiance in its levels that is negative or not finite");
    }
  }
  if (!(environment.unseen_share >= 0 && environment.unseen_share <= 1)) {
    in.fail("says that a share was filled that is not from 0 to 1");
  }
  if (environment.compact_apart && environment.diffused.empty()) {
    in.fail("has lights apart, but no level without them");
  }
  try {
    check(environment), check_levels(environment);
  } catch (const std::invalid_argument& error) {
    in.fail("holds what cannot be: " + std::string(error.what()));
  }
  return environment;
}

}  // namespace render
