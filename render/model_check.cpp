// PLY, STL and FBX files, checked.
#include "render/model_check.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "render/model_format.h"

namespace render {
namespace {

constexpr std::string_view blanks = " \t\r\n\v\f";

[[noreturn]] void refuse(const std::string& why) { throw std::runtime_error(why); }

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Takes a word off the front of `text`; empty at its end.
std::string_view take_word(std::string_view& text) {
  const std::size_t begin = text.find_first_not_of(blanks);
  if (begin == std::string_view::npos) return text = {};
  const std::size_t end = std::min(text.find_first_of(blanks, begin), text.size());
  const std::string_view word = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return word;
}

std::uint64_t count_of(std::string_view word, const std::string& of) {
  std::uint64_t count = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), count);
  if (error != std::errc{} || end != word.data() + word.size()) {
    refuse("the number of " + of + " is no whole number");
  }
  return count;
}

struct Property {
  std::string name = {};
  std::size_t bytes = 0;  // of a value
  std::size_t list = 0;   // of its count, if it is a list
};

struct Element {
  std::string name;
  std::uint64_t rows = 0;
  std::vector<Property> properties;
};

struct PlyHead {
  enum class Format { none, ascii, little, big } format = Format::none;
  std::vector<Element> elements;
  std::string_view body;
};

std::size_t bytes_of(std::string_view type) {
  static constexpr std::array<std::pair<std::string_view, std::size_t>, 16> types{{{"char", 1},
                                                                                   {"uchar", 1},
                                                                                   {"int8", 1},
                                                                                   {"uint8", 1},
                                                                                   {"short", 2},
                                                                                   {"ushort", 2},
                                                                                   {"int16", 2},
                                                                                   {"uint16", 2},
                                                                                   {"int", 4},
                                                                                   {"uint", 4},
                                                                                   {"int32", 4},
                                                                                   {"uint32", 4},
                                                                                   {"float", 4},
                                                                                   {"float32", 4},
                                                                                   {"double", 8},
                                                                                   {"float64", 8}}};
  for (const auto& [name, bytes] : types) {
    if (type == name) return bytes;
  }
  refuse("its header has a property of the unknown type '" + std::string(type.substr(0, 40)) + "'");
}

Property take_property(std::string_view& line) {
  Property property;
  std::string_view type = take_word(line);
  if (type == "list") {
    property.list = bytes_of(take_word(line));
    if (property.list > 4) refuse("its header counts a list in fractions");
    type = take_word(line);
  }
  property.bytes = bytes_of(type);
  property.name = std::string(take_word(line).substr(0, 40));
  return property;
}

PlyHead parse_head(std::string_view text) {
  if (!text.starts_with("ply") && !text.starts_with("PLY")) refuse("it is no PLY file");
  PlyHead head;
  constexpr std::size_t most_lines = 10000;
  for (std::size_t i = 0; i < most_lines; ++i) {
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) refuse("its header does not end");
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end + 1);
    const std::string_view word = take_word(line);
    if (word == "end_header") {
      if (head.format == PlyHead::Format::none) refuse("its header names no format");
      head.body = text;
      return head;
    }
    if (word == "format") {
      const std::string_view format = take_word(line);
      head.format = format == "ascii"                  ? PlyHead::Format::ascii
                    : format == "binary_little_endian" ? PlyHead::Format::little
                    : format == "binary_big_endian"    ? PlyHead::Format::big
                                                       : PlyHead::Format::none;
    } else if (word == "element") {
      Element& element = head.elements.emplace_back();
      element.name = std::string(take_word(line).substr(0, 40));
      element.rows = count_of(take_word(line), element.name + " rows");
    } else if (word == "property") {
      if (head.elements.empty()) refuse("its header has a property of nothing");
      head.elements.back().properties.push_back(take_property(line));
    }
  }
  refuse("its header does not end");
}

[[noreturn]] void refuse_short(const Element& element, std::uint64_t row) {
  refuse("it is cut short: it ends at row " + std::to_string(row) + " of the " +
         std::to_string(element.rows) + " of its element '" + element.name + "'");
}

// What a list's count says, or nothing where the file ends.
std::uint64_t list_count(std::string_view bytes, bool big) {
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const std::size_t at = big ? i : bytes.size() - 1 - i;
    count = count << 8U | static_cast<unsigned char>(bytes[at]);
  }
  return count;
}

// Walks a row of a binary file; false if the file ends in it.
bool skip_row(const Element& element, bool big, std::string_view& body) {
  for (const Property& property : element.properties) {
    std::uint64_t bytes = property.bytes;
    if (property.list > 0) {
      if (body.size() < property.list) return false;
      bytes *= list_count(body.substr(0, property.list), big);
      body.remove_prefix(property.list);
    }
    if (body.size() < bytes) return false;
    body.remove_prefix(static_cast<std::size_t>(bytes));
  }
  return true;
}

bool skip_words(const Element& element, std::string_view& body) {
  for (const Property& property : element.properties) {
    std::string_view word = take_word(body);
    if (word.empty()) return false;
    if (property.list == 0) continue;
    for (std::uint64_t left = count_of(word, "a list's values"); left > 0; --left) {
      if (take_word(body).empty()) return false;
    }
  }
  return true;
}

std::vector<std::string> notes_of(const PlyHead& head) {
  std::vector<std::string> notes;
  if (!head.elements.empty() && head.elements[0].name != "vertex" &&
      std::ranges::find(head.elements, "vertex", &Element::name) != head.elements.end()) {
    refuse("its element '" + head.elements[0].name +
           "' stands before its vertices, which is not read; export it with the vertices first");
  }
  for (const Element& element : head.elements) {
    if (element.rows == 0) continue;
    if (element.name == "tristrips") {
      refuse("it has triangle strips, which are not read; export its faces as polygons");
    }
    if (element.name != "face") continue;
    const auto has = [&](std::string_view name) {
      return std::ranges::any_of(element.properties, [&](const Property& p) {
        return p.name == name || p.name == "diffuse_" + std::string(name);
      });
    };
    if (has("texcoord")) {
      notes.emplace_back(
          "texture coordinates of faces are taken for their vertices: where faces differ, the last "
          "one's count for all");
    }
    if (has("red") || has("green") || has("blue")) {
      notes.emplace_back("colours of faces are left out");
    }
  }
  return notes;
}

constexpr std::size_t stl_header = 80, stl_triangle = 50;  // bytes

// What an ascii STL file says, without what some programs put before it.
std::string_view words_of_stl(std::string_view text) {
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
  return text;
}
bool begins_as_words(std::string_view text) {
  constexpr std::string_view first = "solid";
  return text.size() >= first.size() &&
         std::ranges::equal(text.substr(0, first.size()), first, {}, small_letter);
}
// Whether its length is what its count of triangles says, whatever its header begins with.
bool is_binary_stl(std::string_view text) {
  return text.size() >= stl_header + 4 &&
         text.size() - stl_header - 4 ==
             list_count(text.substr(stl_header, 4), false) * stl_triangle;
}

// What follows a name in a binary FBX record, up to its first number; nothing if there is none.
std::optional<double> number_after(std::string_view text) {
  const auto take = [&]<class T>(T& value) {
    if (text.size() < sizeof value) return false;
    std::memcpy(&value, text.data(), sizeof value);
    text.remove_prefix(sizeof value);
    return true;
  };
  for (int values = 0; values < 5 && !text.empty(); ++values) {
    const char type = text[0];
    text.remove_prefix(1);
    std::uint32_t length = 0;
    std::int32_t number = 0;
    double real = 0;
    if (type == 'D') return take(real) ? std::optional(real) : std::nullopt;
    if (type == 'I') return take(number) ? std::optional<double>(number) : std::nullopt;
    if (type != 'S' || !take(length) || length > text.size()) return std::nullopt;
    text.remove_prefix(length);
  }
  return std::nullopt;
}

// The last number on a line of an ascii FBX file; nothing if there is none.
std::optional<double> number_that_ends(std::string_view line) {
  const std::size_t comma = line.rfind(',');
  if (comma == std::string_view::npos) return std::nullopt;
  line.remove_prefix(comma + 1);
  const std::string_view word = take_word(line);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc{} && end == word.data() + word.size() ? std::optional(value)
                                                                  : std::nullopt;
}

// Whether an FBX file, binary or ascii, has a property of that name whose number is as asked.
template <class Is>
bool any_fbx_property(std::span<const std::byte> file_bytes, std::string_view name, const Is& is) {
  const std::string_view text = text_of(file_bytes);
  const bool binary = text.starts_with("Kaydara FBX Binary");
  const std::string word =
      binary ? std::string{'S', static_cast<char>(name.size()), 0, 0, 0} + std::string(name)
             : '"' + std::string(name) + '"';
  for (std::size_t at = text.find(word); at != std::string_view::npos; at = text.find(word, at)) {
    at += word.size();
    const std::string_view rest = text.substr(at);
    const auto number =
        binary ? number_after(rest) : number_that_ends(rest.substr(0, rest.find('\n')));
    if (number && is(*number)) return true;
  }
  return false;
}

}  // namespace

bool ply_has_paint(std::span<const std::byte> file_bytes) {
  const std::string_view text = text_of(file_bytes);
  const PlyHead head = parse_head(text);
  const std::string_view header = text.substr(0, text.size() - head.body.size());
  return header.find("TextureFile") != std::string_view::npos ||
         std::ranges::find(head.elements, "material", &Element::name) != head.elements.end();
}

std::optional<std::vector<std::byte>> mend_ply(std::span<const std::byte> file_bytes) {
  const PlyHead head = parse_head(text_of(file_bytes));
  if (head.format == PlyHead::Format::ascii || !head.body.starts_with('\n')) return std::nullopt;
  // The header's end as CR LF: of these assimp takes just one.
  const auto place = static_cast<std::ptrdiff_t>(file_bytes.size() - head.body.size() - 1);
  std::vector<std::byte> mended;
  mended.reserve(file_bytes.size() + 1);
  mended.assign(file_bytes.begin(), file_bytes.begin() + place);
  mended.push_back(std::byte{'\r'});
  mended.insert(mended.end(), file_bytes.begin() + place, file_bytes.end());
  return mended;
}

std::vector<std::string> check_ply(std::span<const std::byte> file_bytes) {
  PlyHead head = parse_head(text_of(file_bytes));
  const bool ascii = head.format == PlyHead::Format::ascii;
  const bool big = head.format == PlyHead::Format::big;
  for (const Element& element : head.elements) {
    if (element.properties.empty() && element.rows > 0) {
      refuse("its element '" + element.name + "' has no properties");
    }
    for (std::uint64_t row = 0; row < element.rows; ++row) {
      if (!(ascii ? skip_words(element, head.body) : skip_row(element, big, head.body))) {
        refuse_short(element, row);
      }
    }
  }
  return notes_of(head);
}

void check_stl(std::span<const std::byte> file_bytes) {
  const std::string_view text = text_of(file_bytes);
  if (begins_as_words(words_of_stl(text))) return;  // ascii, or told apart by assimp
  if (text.size() < stl_header + 4) refuse("it is cut short: it ends in its header");
  const std::uint64_t count = list_count(text.substr(stl_header, 4), false);
  if (count * stl_triangle > text.size() - stl_header - 4) {
    refuse("it is cut short: its header says " + std::to_string(count) +
           " triangles, but there are " +
           std::to_string((text.size() - stl_header - 4) / stl_triangle));
  }
}

bool stl_has_paint(std::span<const std::byte> file_bytes) {
  return text_of(file_bytes).substr(0, stl_header).find("COLOR=") != std::string_view::npos;
}

bool obj_colours_some(std::span<const std::byte> file_bytes) {
  constexpr int with_colour = 7;  // words: "v", three of the place, three of the colour
  bool coloured = false, plain = false;
  for (std::string_view text = text_of(file_bytes); !text.empty();) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    if (take_word(line) != "v") continue;
    int words = 1;
    while (words < with_colour && !take_word(line).empty()) ++words;
    (words == with_colour ? coloured : plain) = true;
    if (coloured && plain) return true;
  }
  return false;
}

std::optional<std::vector<std::byte>> mend_stl(std::span<const std::byte> file_bytes) {
  const std::string_view text = text_of(file_bytes), words = words_of_stl(text);
  if (text.starts_with("solid") || !begins_as_words(words) || is_binary_stl(text)) {
    return std::nullopt;
  }
  const bool capitals = !words.starts_with("solid");
  std::vector<std::byte> mended(words.size());
  std::ranges::transform(words, mended.begin(), [&](char c) {
    return static_cast<std::byte>(capitals ? small_letter(c) : c);
  });
  return mended;
}

bool hides_by_visibility(std::span<const std::byte> file_bytes) {
  return any_fbx_property(file_bytes, "Visibility", [](double value) { return value == 0; });
}

bool fbx_clamps(std::span<const std::byte> file_bytes) {
  const auto is_set = [](double value) { return value != 0; };
  return any_fbx_property(file_bytes, "WrapModeU", is_set) ||
         any_fbx_property(file_bytes, "WrapModeV", is_set);
}

}  // namespace render
