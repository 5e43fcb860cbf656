// Material libraries of OBJ.
#include "render/mtl_mend.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string_view>

#include "render/model_format.h"

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
    std::string_view word = next();
    if (word.starts_with('+')) word.remove_prefix(1);
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

void note_once(const std::string& note, MtlFacts& facts) {
  if (std::ranges::find(facts.notes, note) == facts.notes.end()) facts.notes.push_back(note);
}

// Takes the options of a map's line; returns the name of its file, which may have blanks.
std::string_view take_options(const std::string& keyword,
                              const std::string& material,
                              Words words,
                              MtlFacts& facts) {
  MtlMap map{.material = material, .keyword = keyword};
  const auto leave_out = [&](std::string_view option) {
    note_once(
        "material '" + material + "': option " + std::string(option) + " of a map is left out",
        facts);
  };
  bool taken = false;
  std::string_view rest = words.all();
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
    rest = words.all();
  }
  if (taken) facts.maps.push_back(map);
  return rest;
}

bool is_in(std::initializer_list<std::string_view> names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

bool is_map(std::string_view keyword) {
  return keyword.starts_with("map_") || is_in({"norm", "disp", "bump"}, keyword);
}

// Writes one library anew, line by line.
class LibraryMender {
 public:
  explicit LibraryMender(MtlFacts& facts) : facts_(facts) {}

  void take(std::string_view line) {
    Words words(line);
    const std::string_view own = words.next();
    const std::string keyword = in_small_letters(own);
    if (keyword == "newmtl") {
      material_ = words.all();
      facts_.stated[material_];
      write(line);
    } else if (is_map(keyword)) {
      const std::string_view file = take_options(keyword, material_, words, facts_);
      state(keyword);
      write(own, file);
    } else if (is_in({"decal", "refl"}, keyword)) {
      leave_out(Words(line).all());
    } else if (is_in({"ka", "kd", "ks", "ke", "tf"}, keyword)) {
      take_colour(keyword, line, own, words);
    } else if (is_in({"d", "tr", "ns", "ni", "illum", "pr", "pm", "ps", "pc", "pcr"}, keyword)) {
      take_number(keyword, line, own, words);
    } else {
      write(line);
    }
  }
  const std::string& text() const { return text_; }

 private:
  void take_colour(const std::string& keyword,
                   std::string_view line,
                   std::string_view own,
                   Words words) {
    Words values = words;
    const std::string one(words.next());
    if (!is_number(one)) return leave_out(Words(line).all());
    const auto red = values.number();
    const bool grey = red && values.all().empty();
    if (keyword == "tf") {
      const auto green = values.number(), blue = values.number();
      if (red.value_or(1) != 1 || green.value_or(1) != 1 || blue.value_or(1) != 1) {
        leave_out("its filter (Tf)");
      }
    }
    state(keyword);
    if (!grey) return write(line);
    write(own, one + " " + one + " " + one);
  }
  void take_number(const std::string& keyword,
                   std::string_view line,
                   std::string_view own,
                   Words words) {
    std::string_view value = words.next();
    if (keyword == "d" && value == "-halo") {
      leave_out("option -halo of its opacity");
      value = words.next();
    }
    if (!is_number(value)) return leave_out(Words(line).all());
    state(keyword);
    write(own, value);
  }
  // As assimp takes them: else it gives up.
  static bool is_number(std::string_view word) {
    const std::size_t begin = word.find_first_not_of("+-");
    if (begin == std::string_view::npos || begin > 1) return false;
    const std::string start = in_small_letters(word.substr(begin, 3));
    return (start[0] >= '0' && start[0] <= '9') || start == "nan" || start == "inf" ||
           (start.size() > 1 && start[0] == '.' && start[1] >= '0' && start[1] <= '9');
  }

  void leave_out(std::string_view what) {
    constexpr std::size_t most = 80;
    note_once("material '" + material_ + "': " + std::string(what.substr(0, most)) + " is left out",
              facts_);
  }
  void state(const std::string& keyword) { facts_.stated[material_].insert(keyword); }
  void write(std::string_view line) { text_.append(line).append("\n"); }
  void write(std::string_view keyword, std::string_view value) {
    text_.append(keyword).append(" ").append(value).append("\n");
  }

  MtlFacts& facts_;
  std::string material_;
  std::string text_;
};

}  // namespace

std::vector<std::byte> mend_mtl(std::span<const std::byte> library, MtlFacts& facts) {
  std::string_view text(reinterpret_cast<const char*>(library.data()), library.size());
  LibraryMender mender(facts);
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    mender.take(line);
  }
  const std::string& mended = mender.text();
  std::vector<std::byte> bytes(mended.size());
  std::transform(mended.begin(), mended.end(), bytes.begin(),
                 [](char c) { return static_cast<std::byte>(c); });
  return bytes;
}

}  // namespace render
