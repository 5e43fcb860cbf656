// Whole files in and out of memory.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace capture {

// The bytes of a file. Throws std::runtime_error with path and reason if it is missing, is no
// regular file, or is larger than `max_bytes`.
std::vector<std::byte> read_file(const std::string& path,
                                 std::size_t max_bytes = std::size_t{1} << 30);

// Writes beside `path` first and takes its name once all bytes are out, so that nobody ever reads
// half a file, and what was there stays until then. A link's file is replaced, a device or pipe
// written to. Throws std::runtime_error with path and reason.
void write_file(const std::string& path, std::span<const std::byte> bytes);

}  // namespace capture
