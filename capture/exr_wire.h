// What platelight-decode tells its parent over a pipe. Both ends are of one build.
#pragma once

#include <array>
#include <cstdint>

namespace capture::wire {

enum class Kind : std::uint32_t { failure = 1, header, lens, rows, end };

// What a file has under the name of lens_attribute.
enum class LensNote : std::int32_t { none, text, too_long, no_text };

// Before every message.
struct Prefix {
  Kind kind{};
  std::uint32_t bytes = 0;  // of the payload that follows
};

// Payload of `header`. A `lens` follows where there is a text of one, which is its payload; then
// the rows, top to bottom as floats, channels interleaved. Payload of `failure` is a text for
// people; of `rows`, whole rows; `end` has none.
struct Header {
  std::int32_t width = 0;
  std::int32_t height = 0;
  std::int32_t channels = 0;
  std::int32_t has_primaries = 0;
  std::array<float, 8> primaries{};  // x y of red, green, blue, white
  std::int32_t has_noise = 0;
  std::array<float, 2> noise{};  // gain, floor
  float pixel_aspect = 1;
  std::array<char, 32> transfer{};  // a name, and zeros behind it
  LensNote lens = LensNote::none;
};

inline constexpr const char* noise_attribute = "frameNoise";
inline constexpr const char* transfer_attribute = "frameTransfer";
inline constexpr const char* lens_attribute = "frameLens";

// Larger pictures are refused by both ends.
inline constexpr int max_side = 16384;
inline constexpr std::uint32_t max_payload = 64U << 20;

}  // namespace capture::wire
