// Values as bytes and back: little-endian, sizes before contents, every read checked.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace render {

class ByteWriter {
 public:
  template <class T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void put(T value) { append(&value, sizeof(T)); }
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void put_all(std::span<const T> values) {
    put(static_cast<std::uint64_t>(values.size()));
    append(values.data(), values.size_bytes());
  }
  template <class T>
  void put_all(const std::vector<T>& values) {
    put_all(std::span<const T>(values));
  }
  void put_text(const std::string& text) { put_all(std::span<const char>(text)); }

  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  void append(const void* data, std::size_t size);

  std::vector<std::byte> bytes_;
};

// Throws std::runtime_error, naming `what`, where the bytes end too early.
class ByteReader {
 public:
  ByteReader(std::span<const std::byte> bytes, std::string what)
      : bytes_(bytes), what_(std::move(what)) {}

  template <class T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T> T get() {
    if constexpr (std::is_same_v<T, bool>) return get<std::uint8_t>() != 0;
    T value;
    need(sizeof(T));
    std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  template <class T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void get(T& value) { value = get<T>(); }
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void get_all(std::vector<T>& values) {
    const std::size_t count = get_count(sizeof(T));
    values.resize(count);
    if (count > 0) std::memcpy(values.data(), bytes_.data() + at_, count * sizeof(T));
    at_ += count * sizeof(T);
  }
  std::string get_text() {
    std::vector<char> text;
    get_all(text);
    return {text.begin(), text.end()};
  }
  // A count of things that take at least `size` bytes each, checked against what is left.
  std::size_t get_count(std::size_t size) {
    const auto count = get<std::uint64_t>();
    if (count > (bytes_.size() - at_) / size) fail("holds less than it says");
    return static_cast<std::size_t>(count);
  }
  void expect_end() const {
    if (at_ != bytes_.size()) fail("has bytes left over");
  }
  [[noreturn]] void fail(const std::string& reason) const {
    throw std::runtime_error(what_ + " " + reason + " (at byte " + std::to_string(at_) + ")");
  }

 private:
  void need(std::size_t size) const {
    if (size > bytes_.size() - at_) fail("is cut short");
  }

  std::span<const std::byte> bytes_;
  std::string what_;
  std::size_t at_ = 0;
};

}  // namespace render
