// Material libraries of OBJ.
#include "render/mtl_mend.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string_view>

namespace render {
namespace {

constexpr std::string_view blanks_of_mtl = " \t\r";

// Words of a line, one after the other.
class Words {
 public:
  explicit Words(std::string_view line) : rest_(line) {}

  std::string_view next() {
    const std::size_t begin = std::min(rest_.find_first_not_of(blanks_of_mtl), rest_.size());
    rest_.remove_prefix(begin);
    const std::string_view word = rest_.substr(0, rest_.find_first_of(blanks_of_mtl));
    rest_.remove_prefix(word.size());
    return word;
  }
  // The next word if it is a number; else it stays.
  std::optional<float> number() {
    const std::string_view before = rest_;
    const std::string_view word = next();
    float value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (!word.empty() && error == std::errc{} && end == word.data() + word.size() &&
        std::isfinite(value))
      return value;
    rest_ = before;
    return std::nullopt;
  }
  // All that is left, without blanks about it.
  std::string_view all() {
    const std::size_t begin = std::min(rest_.find_first_not_of(blanks_of_mtl), rest_.size());
    const std::size_t end = rest_.find_last_not_of(blanks_of_mtl) + 1;
    return begin < end ? rest_.substr(begin, end - begin) : std::string_view{};
  }

 private:
  std::string_view rest_;
};

// Up to three numbers; the first two go into `values`.
void take_numbers(Words& words, std::array<float, 2>& values) {
  for (std::size_t i = 0; i < 3; ++i) {
    const auto value = words.number();
    if (!value) return;
    if (i < 2) values[i] = *value;
  }
}

void take_options(const std::string& keyword,
                  const std::string& material,
                  Words words,
                  MtlFacts& facts) {
  MtlMap map{.material = material, .keyword = keyword};
  const auto leave_out = [&](std::string_view option) {
    const std::string note =
        "material '" + material + "': option " + std::string(option) + " of a map is left out";
    if (std::ranges::find(facts.notes, note) == facts.notes.end()) facts.notes.push_back(note);
  };
  bool taken = false;
  for (std::string_view word = words.next(); word.starts_with('-'); word = words.next()) {
    std::array<float, 2> numbers{0, 1};
    if (word == "-s") {
      take_numbers(words, map.scale);
      taken = true;
    } else if (word == "-o") {
      take_numbers(words, map.offset);
      taken = true;
    } else if (word == "-clamp") {
      map.clamps = words.next() == "on";
      taken = true;
    } else if (word == "-mm" || word == "-t") {
      const bool gain = word == "-mm";
      if (!gain) numbers = {0, 0};
      const auto nothing = numbers;
      take_numbers(words, numbers);
      if (numbers != nothing) leave_out(word);
    } else if (word == "-bm" || word == "-boost" || word == "-texres") {
      take_numbers(words, numbers);  // of maps that are noted anyway, and of filters
    } else {
      if (word == "-imfchan") leave_out(word);
      words.next();
    }
  }
  if (taken) facts.maps.push_back(map);
}

std::string in_small_letters(std::string_view word) {
  std::string text(word);
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

}  // namespace

std::vector<std::byte> mend_mtl(std::span<const std::byte> library, MtlFacts& facts) {
  std::string_view text(reinterpret_cast<const char*>(library.data()), library.size());
  std::string mended, material;
  mended.reserve(text.size());
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    Words words(line);
    const std::string keyword = in_small_letters(words.next());
    if (keyword == "newmtl") {
      material = words.all();
      facts.materials.insert(material);
    }
    mended.append(line);
    if (keyword == "ka" || keyword == "kd" || keyword == "ks" || keyword == "ke") {
      Words values = words;
      const std::string one(Words(words).next());
      if (values.number() && values.all().empty()) {
        while (!mended.empty() && blanks_of_mtl.find(mended.back()) != std::string_view::npos)
          mended.pop_back();
        mended.append(" ").append(one).append(" ").append(one);
      }
    } else if (keyword.starts_with("map_") || keyword == "norm" || keyword == "disp") {
      take_options(keyword, material, words, facts);
    }
    mended.append("\n");
  }
  std::vector<std::byte> bytes(mended.size());
  std::transform(mended.begin(), mended.end(), bytes.begin(),
                 [](char c) { return static_cast<std::byte>(c); });
  return bytes;
}

}  // namespace render
