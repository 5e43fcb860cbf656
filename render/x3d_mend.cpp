// X3D files, mended.
#include "render/x3d_mend.h"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

namespace render {
namespace {

// The first name of a list in quotes; without quotes, all of it.
std::string_view first_name(std::string_view list) {
  for (const std::string_view quote : {std::string_view("\""), std::string_view("&quot;")}) {
    const std::size_t begin = list.find(quote);
    if (begin == std::string_view::npos) continue;
    const std::string_view rest = list.substr(begin + quote.size());
    return rest.substr(0, rest.find(quote));
  }
  return list;
}

// Where the value of a tag's attribute `url` is; empty if it has none.
std::string_view url_of(std::string_view tag) {
  constexpr std::string_view blanks = " \t\r\n";
  for (std::size_t at = tag.find("url"); at != std::string_view::npos;
       at = tag.find("url", at + 1)) {
    if (blanks.find(tag[at - 1]) == std::string_view::npos) continue;
    const std::size_t equals = tag.find_first_not_of(blanks, at + 3);
    if (equals == std::string_view::npos || tag[equals] != '=') continue;
    const std::size_t begin = tag.find_first_not_of(blanks, equals + 1);
    if (begin == std::string_view::npos || (tag[begin] != '\'' && tag[begin] != '"')) continue;
    const std::size_t end = tag.find(tag[begin], begin + 1);
    if (end != std::string_view::npos) return tag.substr(begin + 1, end - begin - 1);
  }
  return {};
}

// Where the next tag of that name begins, from `at` on, comments left aside.
std::size_t find_tag(std::string_view text, std::string_view name, std::size_t at = 0) {
  for (at = text.find('<', at); at != std::string_view::npos; at = text.find('<', at + 1)) {
    const std::string_view rest = text.substr(at);
    if (rest.starts_with("<!--")) {
      at = text.find("-->", at);
      if (at == std::string_view::npos) break;
    } else if (rest.substr(1).starts_with(name)) {
      constexpr std::string_view ends = " \t\r\n/>";
      const std::string_view after = rest.substr(1 + name.size());
      if (!after.empty() && ends.find(after[0]) != std::string_view::npos) return at;
    }
  }
  return std::string_view::npos;
}

// With blanks in the place of Inline nodes.
std::string without_inlines(std::string_view text) {
  std::string result(text);
  constexpr std::string_view closing = "</Inline>";
  for (std::size_t at = find_tag(text, "Inline"); at != std::string_view::npos;
       at = find_tag(text, "Inline", at + 1)) {
    std::size_t end = at;  // of its tag; '>' may stand in quotes
    for (char quote = 0; end < text.size() && (quote != 0 || text[end] != '>'); ++end) {
      if (quote == 0 && (text[end] == '"' || text[end] == '\'')) {
        quote = text[end];
      } else if (text[end] == quote) {
        quote = 0;
      }
    }
    if (end >= text.size()) break;
    if (text[end - 1] != '/') {
      const std::size_t close = text.find(closing, end);
      if (close == std::string_view::npos) break;
      end = close + closing.size() - 1;
    }
    std::fill(result.begin() + static_cast<std::ptrdiff_t>(at),
              result.begin() + static_cast<std::ptrdiff_t>(end + 1), ' ');
    at = end;
  }
  return result;
}

}  // namespace

std::vector<std::string> left_out_of_x3d(std::span<const std::byte> file_bytes) {
  const std::string_view text(reinterpret_cast<const char*>(file_bytes.data()), file_bytes.size());
  std::vector<std::string> notes;
  if (find_tag(text, "Inline") != std::string_view::npos) {
    notes.emplace_back("Inline nodes, files that it shows within it, are left out");
  }
  if (find_tag(text, "ProtoInstance") != std::string_view::npos) {
    notes.emplace_back("instances of prototypes (ProtoInstance) are left out");
  }
  for (const std::string name : {"Anchor", "Billboard", "Collision", "LOD"}) {
    if (find_tag(text, name) != std::string_view::npos) {
      notes.push_back("what is below " + name + " nodes is left out");
    }
  }
  for (const std::string name : {"MovieTexture", "MultiTexture", "PixelTexture"}) {
    if (find_tag(text, name) != std::string_view::npos) {
      notes.push_back("pictures of " + name + " nodes are left out");
    }
  }
  for (std::size_t at = find_tag(text, "unit"); at != std::string_view::npos;
       at = find_tag(text, "unit", at + 1)) {
    if (text.substr(at, text.find('>', at) - at).find("length") == std::string_view::npos) continue;
    notes.emplace_back("its unit of length is taken for a metre: set the object's scale");
    break;
  }
  return notes;
}

std::vector<std::byte> mend_x3d(std::span<const std::byte> file_bytes) {
  constexpr std::string_view opening = "<ImageTexture";
  const std::string whole =
      without_inlines({reinterpret_cast<const char*>(file_bytes.data()), file_bytes.size()});
  const std::string_view text = whole;
  std::string mended;
  mended.reserve(text.size());
  std::size_t copied = 0;
  for (std::size_t at = text.find(opening); at != std::string_view::npos;
       at = text.find(opening, at + 1)) {
    const std::string_view url = url_of(text.substr(at, text.find('>', at) - at));
    if (url.empty()) continue;
    const auto begin = static_cast<std::size_t>(url.data() - text.data());
    mended.append(text.substr(copied, begin - copied)).append(first_name(url));
    copied = begin + url.size();
  }
  mended.append(text.substr(copied));
  std::vector<std::byte> bytes(mended.size());
  std::transform(mended.begin(), mended.end(), bytes.begin(),
                 [](char c) { return static_cast<std::byte>(c); });
  return bytes;
}

}  // namespace render
