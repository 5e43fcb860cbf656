// What platelight-decode tells its parent over a pipe. Both ends are of one build.
#pragma once

#include <array>
#include <cstdint>

namespace capture::wire {

enum class Kind : std::uint32_t { failure = 1, header, rows, end };

// Before every message.
struct Prefix {
  Kind kind{};
  std::uint32_t bytes = 0;  // of the payload that follows
};

// Payload of `header`. The rows follow top to bottom as floats, channels interleaved. Payload of
// `failure` is a text for people; of `rows`, whole rows; `end` has none.
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
};

inline constexpr const char* noise_attribute = "frameNoise";
inline constexpr const char* transfer_attribute = "frameTransfer";

// Larger pictures are refused by both ends.
inline constexpr int max_side = 16384;
inline constexpr std::uint32_t max_payload = 64U << 20;

}  // namespace capture::wire
