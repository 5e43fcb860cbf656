// Standard input and output of our own helper programs (sandbox.h). For their sources alone.
#pragma once

#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <system_error>
#include <type_traits>

namespace capture {

// Fills `bytes`. Throws std::system_error if they cannot be read, std::runtime_error if the input
// ends before.
inline void read_all(std::span<std::byte> bytes, int fd = STDIN_FILENO) {
  while (!bytes.empty()) {
    const ssize_t got = read(fd, bytes.data(), bytes.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw std::system_error(errno, std::generic_category(), "cannot read");
    if (got == 0) throw std::runtime_error("what it is to read ends too early");
    bytes = bytes.subspan(static_cast<std::size_t>(got));
  }
}

// Throws std::system_error if they cannot be written.
inline void write_all(std::span<const std::byte> bytes, int fd = STDOUT_FILENO) {
  while (!bytes.empty()) {
    const ssize_t done = write(fd, bytes.data(), bytes.size());
    if (done < 0 && errno == EINTR) continue;
    if (done < 0) throw std::system_error(errno, std::generic_category(), "cannot write");
    bytes = bytes.subspan(static_cast<std::size_t>(done));
  }
}

// The bytes of one value. Throws as the others do.
template <class T>
T read_value(int fd = STDIN_FILENO) {
  static_assert(std::is_trivially_copyable_v<T>);
  T value;
  read_all(std::as_writable_bytes(std::span(&value, 1)), fd);
  return value;
}
template <class T>
void write_value(const T& value, int fd = STDOUT_FILENO) {
  static_assert(std::is_trivially_copyable_v<T>);
  write_all(std::as_bytes(std::span(&value, 1)), fd);
}

// A message of those that begin with a Prefix: what kind it is, and how many bytes follow. Throws
// as write_all().
template <class Prefix>
void send_message(decltype(Prefix::kind) kind, std::span<const std::byte> payload) {
  write_value(Prefix{kind, static_cast<std::uint32_t>(payload.size())});
  write_all(payload);
}

}  // namespace capture
