// Matroska's elements are an id, a size, and data (RFC 8794): found, and changed in place.
#include "compositing/matroska_mend.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdio>
#include <span>
#include <string_view>

namespace compositing {
namespace {

// RFC 9559.
enum Id : std::uint32_t {
  segment = 0x18538067,
  info = 0x1549A966,
  timestamp_scale = 0x2AD7B1,
  duration = 0x4489,
  cluster = 0x1F43B675,
  cues = 0x1C53BB6B,
  cue_point = 0xBB,
  cue_track_positions = 0xB7,
  cue_cluster_position = 0xF1,
  tags = 0x1254C367,
  simple_tag = 0x67C8,
  tag_name = 0x45A3,
  tag_string = 0x4487
};
constexpr std::uint8_t void_id = 0xEC, crc_id = 0xBF;
constexpr int most_elements = 1'000'000;  // that are looked at

struct Element {
  std::uint32_t id = 0;
  std::int64_t place = 0, data = 0, end = 0;
};

class Elements {
 public:
  explicit Elements(int descriptor) : descriptor_(descriptor) {}

  bool read(std::int64_t place, std::span<std::uint8_t> bytes) const {
    return ::pread(descriptor_, bytes.data(), bytes.size(), place) ==
           static_cast<ssize_t>(bytes.size());
  }
  void write(std::int64_t place, std::span<const std::uint8_t> bytes) const {
    // What cannot be written stays as it was.
    [[maybe_unused]] const ssize_t count = ::pwrite(descriptor_, bytes.data(), bytes.size(), place);
  }
  std::uint64_t number(const Element& element) const {
    std::array<std::uint8_t, 8> bytes{};
    const auto size = static_cast<std::size_t>(std::clamp<std::int64_t>(
        element.end - element.data, 0, static_cast<std::int64_t>(bytes.size())));
    if (!read(element.data, std::span(bytes).first(size))) return 0;
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i) value = value << 8 | bytes[i];
    return value;
  }

  // Calls visit(element) for those one after the other up to `end`, until it returns false.
  template <class F>
  void each(std::int64_t place, std::int64_t end, F&& visit) {
    Element element;
    while (place < end && ++seen_ < most_elements && at(place, end, element) && visit(element)) {
      place = element.end;
    }
  }
  template <class F>
  void each(const Element& parent, F&& visit) {
    each(parent.data, parent.end, visit);
  }

 private:
  bool at(std::int64_t place, std::int64_t end, Element& element) const {
    std::array<std::uint8_t, 12> head{};
    const std::int64_t there = std::min<std::int64_t>(end - place, 12);
    if (there < 2 || !read(place, std::span(head).first(static_cast<std::size_t>(there)))) {
      return false;
    }
    const int of_id = std::countl_zero(head[0]) + 1;
    if (of_id > 4) return false;
    std::uint32_t id = 0;
    for (int i = 0; i < of_id; ++i) id = id << 8 | head[static_cast<std::size_t>(i)];
    const std::uint8_t first = head[static_cast<std::size_t>(of_id)];
    const int of_size = std::countl_zero(first) + 1;
    if (of_size > 8 || of_id + of_size > there) return false;
    std::uint64_t size = first & ((1U << (8 - of_size)) - 1);
    bool open = size == (1U << (8 - of_size)) - 1;
    for (int i = 1; i < of_size; ++i) {
      const std::uint8_t byte = head[static_cast<std::size_t>(of_id + i)];
      open = open && byte == 0xFF;
      size = size << 8 | byte;
    }
    const std::int64_t data = place + of_id + of_size;
    const bool reaches_beyond = size > static_cast<std::uint64_t>(end - data);
    element = {id, place, data,
               open || reaches_beyond ? end : data + static_cast<std::int64_t>(size)};
    return data <= end;
  }

  int descriptor_;
  int seen_ = 0;
};

template <std::size_t n>
std::array<std::uint8_t, n> big_endian(std::uint64_t bits) {
  std::array<std::uint8_t, n> bytes{};
  for (std::size_t i = 0; i < n; ++i) {
    bytes[i] = static_cast<std::uint8_t>(bits >> (8 * (n - 1 - i)));
  }
  return bytes;
}

// An element's check sum, which begins it, is no longer that of what it holds.
void void_check(Elements& file, const Element& parent) {
  file.each(parent, [&](const Element& element) {
    if (element.id == crc_id) file.write(element.place, std::array{void_id});
    return false;
  });
}

void shorten_info(Elements& file, const Element& parent, double length_s) {
  double ns_per_tick = 1e6;
  Element told;
  file.each(parent, [&](const Element& element) {
    if (element.id == timestamp_scale) ns_per_tick = static_cast<double>(file.number(element));
    if (element.id == duration) told = element;
    return true;
  });
  const double ticks = length_s * 1e9 / ns_per_tick;
  const std::uint64_t bits = file.number(told);
  if (told.end - told.data == 8 && std::bit_cast<double>(bits) > ticks) {
    file.write(told.data, big_endian<8>(std::bit_cast<std::uint64_t>(ticks)));
  } else if (told.end - told.data == 4 &&
             std::bit_cast<float>(static_cast<std::uint32_t>(bits)) > ticks) {
    file.write(told.data, big_endian<4>(std::bit_cast<std::uint32_t>(static_cast<float>(ticks))));
  }
}

// A track's "hours:minutes:seconds", to the nanosecond, which sorts as text.
void shorten_tag(Elements& file, const Element& simple, double length_s) {
  static constexpr std::string_view name = "DURATION";
  constexpr std::size_t digits = 18;
  bool is_duration = false;
  Element told;
  file.each(simple, [&](const Element& element) {
    std::array<std::uint8_t, name.size()> there{};
    if (element.id == tag_name && element.end - element.data == std::ssize(there)) {
      is_duration = file.read(element.data, there) && std::ranges::equal(there, name);
    }
    if (element.id == tag_string) told = element;
    return true;
  });
  std::array<std::uint8_t, digits> before{};
  if (!is_duration || told.end - told.data < std::ssize(before)) return;
  if (!file.read(told.data, before)) return;
  const auto whole = static_cast<std::int64_t>(length_s);
  std::array<char, 64> after{};
  std::snprintf(after.data(), after.size(), "%02d:%02d:%012.9f", static_cast<int>(whole / 3600),
                static_cast<int>(whole / 60 % 60), length_s - static_cast<double>(whole / 60 * 60));
  std::array<std::uint8_t, digits> bytes{};
  std::copy_n(after.begin(), digits, bytes.begin());
  if (bytes < before) file.write(told.data, bytes);
}

void void_cues(Elements& file, const Element& index, std::int64_t origin, std::int64_t end) {
  file.each(index, [&](const Element& point) {
    bool is_lost = false;
    file.each(point, [&](const Element& position) {
      if (position.id != cue_track_positions) return true;
      file.each(position, [&](const Element& element) {
        is_lost = is_lost || (element.id == cue_cluster_position &&
                              file.number(element) >= static_cast<std::uint64_t>(end - origin));
        return true;
      });
      return true;
    });
    if (point.id == cue_point && is_lost) file.write(point.place, std::array{void_id});
    return true;
  });
}

}  // namespace

void mend_cut_matroska(int descriptor, std::int64_t end, double length_s) noexcept {
  const std::int64_t all = ::lseek(descriptor, 0, SEEK_END);
  Elements file(descriptor);
  file.each(0, all, [&](const Element& top) {
    if (top.id != segment) return true;
    file.each(top, [&](const Element& element) {
      if (element.id == info) {
        void_check(file, element);
        shorten_info(file, element, length_s);
      }
      if (element.id == tags) {
        void_check(file, element);
        file.each(element, [&](const Element& one) {
          file.each(one, [&](const Element& simple) {
            if (simple.id == simple_tag) shorten_tag(file, simple, length_s);
            return true;
          });
          return true;
        });
      }
      return element.id != cluster;
    });
    file.each(end, all, [&](const Element& element) {
      if (element.id == cues) {
        void_check(file, element);
        void_cues(file, element, top.data, end);
      }
      return true;
    });
    return false;
  });
}

}  // namespace compositing
