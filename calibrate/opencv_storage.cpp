// The values in a file of OpenCV's FileStorage, and in YAML of its kind.
#include "calibrate/opencv_storage.h"

#include <algorithm>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>

#include "calibrate/text_file.h"

namespace calibrate {
namespace {

constexpr std::size_t largest_bytes = std::size_t{4} << 20U;
constexpr std::size_t most_values = 100000;
constexpr std::size_t deepest = 16;
constexpr std::size_t longest_key = 200;

constexpr std::string_view blanks = " \t\r\n";

std::string_view trim(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(blanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(blanks) - begin + 1);
}

std::string_view unquoted(std::string_view text) {
  if (text.size() >= 2 && (text.front() == '"' || text.front() == '\'') &&
      text.back() == text.front()) {
    return text.substr(1, text.size() - 2);
  }
  return text;
}

// Lines with their numbers, one after the other.
class Lines {
 public:
  explicit Lines(std::string_view text) : rest_(text) {}
  bool next(std::string_view& line) {
    if (rest_.empty()) return false;
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    line = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    ++number_;
    return true;
  }
  int number() const { return number_; }

 private:
  std::string_view rest_;
  int number_ = 0;
};

// How many brackets a text opens more than it closes; quotes hide brackets.
int open_brackets(std::string_view text) {
  int open = 0;
  char quote = 0;
  for (const char c : text) {
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '[' || c == '{') {
      ++open;
    } else if (c == ']' || c == '}') {
      --open;
    }
  }
  return open;
}

// Where the colon behind a key is; npos if there is no key.
std::size_t colon_of(std::string_view content) {
  for (std::size_t i = 0; i < content.size(); ++i) {
    if (content[i] != ':') continue;
    if (i + 1 == content.size() || blanks.find(content[i + 1]) != std::string_view::npos ||
        content[i + 1] == '[') {
      return i;
    }
  }
  return std::string_view::npos;
}

}  // namespace

OpencvStorage::OpencvStorage(const std::string& path) : path_(path) {
  const std::string text = read_text_file(path);
  if (text.size() > largest_bytes) {
    throw std::runtime_error(path + ": is larger than 4 MB; a lens takes less than one");
  }
  const std::size_t zero = text.find('\0');
  if (zero != std::string::npos) {
    fail(static_cast<int>(1 +
                          std::count(text.begin(), text.begin() + static_cast<long>(zero), '\n')),
         "has a zero byte: this is no text file");
  }
  if (path.ends_with(".xml")) {
    parse_xml(text);
  } else {
    parse_yaml(text);
  }
}

void OpencvStorage::fail(int line, const std::string& why) const {
  throw std::runtime_error(path_ + ":" + std::to_string(line) + ": " + why);
}

const StoredValue* OpencvStorage::find(std::string_view key) const {
  const auto first = std::ranges::find(values_, key, &StoredValue::key);
  if (first == values_.end()) return nullptr;
  const auto second = std::find_if(first + 1, values_.end(),
                                   [&](const StoredValue& value) { return value.key == key; });
  if (second != values_.end()) {
    fail(second->line, "\"" + std::string(key) + "\" is here for the second time");
  }
  return &*first;
}

bool OpencvStorage::has(std::string_view key) const {
  return std::ranges::any_of(values_, [&](const StoredValue& value) {
    return value.key.starts_with(key) &&
           (value.key.size() == key.size() || value.key[key.size()] == '/');
  });
}

std::vector<StoredValue> OpencvStorage::values_below(std::string_view key) const {
  const std::string prefix = std::string(key) + "/";
  std::vector<StoredValue> below;
  for (const StoredValue& value : values_) {
    if (value.key.starts_with(prefix)) below.push_back(value);
  }
  return below;
}

std::vector<std::string> OpencvStorage::top_keys() const {
  std::vector<std::string> keys;
  for (const StoredValue& value : values_) {
    const std::string key = value.key.substr(0, value.key.find('/'));
    if (std::ranges::find(keys, key) == keys.end()) keys.push_back(key);
  }
  return keys;
}

void OpencvStorage::keep(const std::vector<std::string>& keys, std::string text, int line) {
  if (values_.size() == most_values) fail(line, "has more than 100000 values");
  std::string key;
  for (const std::string& part : keys) key += (key.empty() ? "" : "/") + part;
  values_.push_back({std::move(key), std::move(text), line});
}

void OpencvStorage::parse_yaml(std::string_view text) {
  struct Level {
    std::size_t indent;
    std::string key;
  };
  std::vector<Level> around;
  Lines lines(text);
  std::string_view line;
  while (lines.next(line)) {
    std::string_view content = trim(line);
    if (content.empty() || content.starts_with('#') || content.starts_with('%') ||
        content.starts_with("---") || content == "...") {
      continue;
    }
    std::size_t indent = line.find_first_not_of(' ');
    if (line[indent] == '\t') fail(lines.number(), "YAML is indented by spaces, not by tabs");
    const auto leave = [&] {
      while (!around.empty() && around.back().indent >= indent) around.pop_back();
    };
    const auto enter = [&](std::string_view key) {
      if (around.size() == deepest) fail(lines.number(), "is nested too deeply");
      if (key.empty() || key.size() > longest_key) fail(lines.number(), "has no key here");
      around.push_back({indent, std::string(key)});
    };
    // Items of a list stand at their key's indent or deeper.
    while (content.starts_with("- ") || content == "-") {
      ++indent;
      leave();
      enter("_");
      content = trim(content.substr(1));
      ++indent;
    }
    if (content.empty()) continue;
    std::string_view value = content;
    const bool item = !around.empty() && around.back().key == "_" &&
                      around.back().indent < indent && colon_of(content) == std::string_view::npos;
    if (!item) {
      leave();
      const std::size_t colon = colon_of(content);
      if (colon == std::string_view::npos || content.starts_with('[') || content.starts_with('{')) {
        fail(lines.number(), "expects a key, a colon and a value");
      }
      enter(unquoted(trim(content.substr(0, colon))));
      value = trim(content.substr(colon + 1));
    }
    if (value.starts_with("!")) {  // !!opencv-matrix: the values below tell
      value = trim(value.substr(std::min(value.find(' '), value.size())));
    }
    if (value.empty() || value.starts_with('#')) continue;  // others are below

    const int first_line = lines.number();
    std::string whole(value);
    if (value.starts_with('[') || value.starts_with('{')) {
      int open = open_brackets(value);
      while (open > 0) {
        if (!lines.next(line)) fail(first_line, "a list begins here and does not end");
        whole += ' ';
        whole += trim(line);
        open += open_brackets(line);
      }
      const std::size_t end = whole.find_last_of("]}");
      if (open < 0 || end == std::string::npos) fail(first_line, "a bracket closes nothing here");
      whole = whole.substr(1, end - 1);
    } else if (value.starts_with('"') || value.starts_with('\'')) {
      whole = unquoted(value);
    } else {
      whole = trim(value.substr(0, value.find(" #")));
    }
    std::vector<std::string> keys;
    for (const Level& level : around) keys.push_back(level.key);
    keep(keys, std::move(whole), first_line);
    around.pop_back();
    if (item) enter("_");
  }
}

void OpencvStorage::parse_xml(std::string_view text) {
  std::vector<std::string> around;
  std::string inside;     // the text of the innermost element so far
  bool has_none = false;  // whether the innermost element holds no others so far
  bool ended = false;
  int line = 1;
  std::size_t at = 0;
  // Up to the next `mark` and over it.
  const auto take_until = [&](std::string_view mark, const std::string& what) {
    const std::size_t end = text.find(mark, at);
    if (end == std::string_view::npos) fail(line, what + " begins here and does not end");
    const std::string_view taken = text.substr(at, end - at);
    line += static_cast<int>(std::ranges::count(taken, '\n'));
    at = end + mark.size();
    return taken;
  };
  while (at < text.size()) {
    if (text[at] != '<') {
      const std::size_t end = std::min(text.find('<', at), text.size());
      const std::string_view between = text.substr(at, end - at);
      if (around.empty() && !trim(between).empty()) fail(line, "has text outside of its tags");
      inside += between;
      line += static_cast<int>(std::ranges::count(between, '\n'));
      at = end;
      continue;
    }
    if (text.substr(at).starts_with("<!--")) {
      at += 4;
      take_until("-->", "a comment");
      continue;
    }
    if (text.substr(at).starts_with("<?")) {
      take_until("?>", "a declaration");
      continue;
    }
    ++at;
    const std::string_view tag = trim(take_until(">", "a tag"));
    if (tag.starts_with('/')) {
      if (around.empty() || around.back() != trim(tag.substr(1))) {
        fail(line, "</" + std::string(trim(tag.substr(1)).substr(0, longest_key)) +
                       "> closes what is not open");
      }
      if (has_none && around.size() > 1) {
        keep({around.begin() + 1, around.end()}, std::string(unquoted(trim(inside))), line);
      }
      around.pop_back();
      ended = around.empty();
      has_none = false;
      inside.clear();
      continue;
    }
    const std::string_view name = tag.substr(0, tag.find_first_of(" \t\r\n/"));
    if (name.empty() || name.size() > longest_key || name.starts_with('!')) {
      fail(line, "expects the name of a tag");
    }
    if (ended || (around.empty() && name != "opencv_storage")) {
      fail(line, "is not one <opencv_storage>, as OpenCV writes it");
    }
    if (around.size() == deepest) fail(line, "is nested too deeply");
    has_none = !tag.ends_with('/');
    inside.clear();
    if (has_none) around.emplace_back(name);
  }
  if (!around.empty()) fail(line, "<" + around.back() + "> does not end");
  if (!ended) fail(line, "is not one <opencv_storage>, as OpenCV writes it");
}

}  // namespace calibrate
