// What platelight-model and its parent tell each other. Both ends are of one build.
//
// The parent writes what is to be read (Request), the helper asks for files by name as it meets
// them (Kind::open, Kind::exists) and is answered (Answer), and ends with the model: Kind::head
// (raw_model.h), then, with nothing between, the arrays of each mesh in the order of
// RawSizes::OfMesh, then the bytes of each texture. Or it ends with a Kind::failure.
#pragma once

#include <cstddef>
#include <cstdint>

namespace render::wire {

enum class Kind : std::uint32_t { failure = 1, wrong_option, open, exists, head };

// Before every message of the helper. Payload of failure and wrong_option: a text for people; of
// open and exists: a file's name.
struct Prefix {
  Kind kind{};
  std::uint32_t bytes = 0;
};

// Begins the conversation; followed by the options' bytes (put_request in model_process.h).
struct Limits {
  std::uint64_t memory_bytes = 0;
  std::uint64_t processor_s = 0;
  std::uint64_t request_bytes = 0;
};

// To open and exists; to open, that many bytes follow.
struct Answer {
  std::uint64_t found = 0;
  std::uint64_t bytes = 0;
};

inline constexpr std::uint32_t max_text = 1U << 16;
inline constexpr std::uint32_t max_head = 256U << 20;

}  // namespace render::wire
