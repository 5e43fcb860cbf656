// Tables of set files.
#include "studio/section.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <system_error>

#include <fmt/format.h>

namespace studio {
namespace {

using Kind = TomlValue::Kind;

// Levenshtein, "Binary codes capable of correcting deletions, insertions, and reversals", 1966.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

template <class Words>
std::string joined(const Words& words) {
  std::string list;
  for (const auto& word : words) {
    if (!list.empty()) list += ", ";
    list += fmt::format("\"{}\"", word);
  }
  return list;
}

}  // namespace

std::string to_string(const Diagnostic& d) {
  return d.line > 0 ? fmt::format("{}:{}:{}: {}", d.file, d.line, d.column, d.message)
                    : fmt::format("{}: {}", d.file, d.message);
}

std::vector<Diagnostic> Faults::sorted() const {
  std::vector<Diagnostic> sorted = diagnostics_;
  std::ranges::stable_sort(sorted, [](const Diagnostic& a, const Diagnostic& b) {
    return std::pair(a.line, a.column) < std::pair(b.line, b.column);
  });
  return sorted;
}

Section::Section(const TomlValue& table, std::string name, Faults& faults)
    : table_(&table), name_(std::move(name)), faults_(&faults) {}

const TomlEntry* Section::find(std::string_view key) const {
  const auto found = std::ranges::find(table_->entries, key, &TomlEntry::key);
  return found == table_->entries.end() ? nullptr : &*found;
}

Place Section::place_of(std::string_view key) const {
  const TomlEntry* entry = find(key);
  return entry == nullptr ? table_->place : entry->value.place;
}

std::string Section::full(std::string_view key) const {
  if (name_.empty() || key.empty()) return name_ + std::string(key);
  return fmt::format("{}.{}", name_, key);
}

void Section::fault(std::string_view key, const std::string& message) {
  faults_->add(place_of(key), fmt::format("{} {}", full(key), message));
}

const TomlValue* Section::take(std::string_view key) {
  if (std::ranges::find(known_, key) == known_.end()) known_.emplace_back(key);
  const TomlEntry* entry = find(key);
  return entry == nullptr ? nullptr : &entry->value;
}

const TomlValue* Section::take(std::string_view key, Kind kind) {
  const TomlValue* value = take(key);
  if (value == nullptr) return nullptr;
  const bool fits = value->kind == kind || (kind == Kind::number && value->kind == Kind::integer);
  if (fits) return value;
  fault(key, fmt::format("is {}, but must be {}", name_of(value->kind), name_of(kind)));
  return nullptr;
}

const TomlValue* Section::value(std::string_view key) { return take(key); }

std::optional<double> Section::checked(std::string_view key, const TomlValue& value, Range range) {
  if (value.kind != Kind::integer && value.kind != Kind::number) {
    faults_->add(value.place,
                 fmt::format("{} holds {}, but must hold numbers", full(key), name_of(value.kind)));
    return std::nullopt;
  }
  if (!std::isfinite(value.number)) {
    faults_->add(value.place, fmt::format("{} is not a finite number", full(key)));
    return std::nullopt;
  }
  if (value.number < range.low || value.number > range.high) {
    faults_->add(value.place, fmt::format("{} is {:g}, but must be from {:g} to {:g}", full(key),
                                          value.number, range.low, range.high));
    return std::nullopt;
  }
  return value.number;
}

bool Section::boolean(std::string_view key, bool& target) {
  const TomlValue* value = take(key, Kind::boolean);
  if (value == nullptr) return false;
  target = value->boolean;
  return true;
}

bool Section::integer(std::string_view key,
                      std::int64_t& target,
                      std::int64_t low,
                      std::int64_t high) {
  const TomlValue* value = take(key, Kind::integer);
  if (value == nullptr) return false;
  if (value->integer < low || value->integer > high) {
    fault(key, fmt::format("is {}, but must be from {} to {}", value->integer, low, high));
    return false;
  }
  target = value->integer;
  return true;
}

bool Section::integer(std::string_view key, int& target, int low, int high) {
  std::int64_t wide = 0;
  if (!integer(key, wide, std::int64_t{low}, std::int64_t{high})) return false;
  target = static_cast<int>(wide);
  return true;
}

bool Section::number(std::string_view key, double& target, Range range) {
  const TomlValue* value = take(key, Kind::number);
  if (value == nullptr) return false;
  const std::optional<double> good = checked(key, *value, range);
  if (good) target = *good;
  return good.has_value();
}

bool Section::number(std::string_view key, float& target, Range range) {
  double wide = 0;
  if (!number(key, wide, range)) return false;
  target = static_cast<float>(wide);
  return true;
}

bool Section::text(std::string_view key, std::string& target) {
  const TomlValue* value = take(key, Kind::text);
  if (value == nullptr) return false;
  if (value->text.empty() || value->text.find('\0') != std::string::npos) {
    fault(key, value->text.empty() ? "is empty" : "holds a zero character");
    return false;
  }
  target = value->text;
  return true;
}

bool Section::word(std::string_view key,
                   std::string& target,
                   std::span<const std::string_view> words) {
  std::string given;
  if (!text(key, given)) return false;
  if (std::ranges::find(words, given) == words.end()) {
    fault(key, fmt::format("is \"{}\", but must be one of {}", given, joined(words)));
    return false;
  }
  target = given;
  return true;
}

bool Section::texts(std::string_view key, std::vector<std::string>& target) {
  const TomlValue* value = take(key, Kind::array);
  if (value == nullptr) return false;
  std::vector<std::string> read;
  for (const TomlValue& item : value->items) {
    if (item.kind != Kind::text || item.text.empty()) {
      faults_->add(item.place, fmt::format("{} must hold strings that are not empty", full(key)));
      return false;
    }
    read.push_back(item.text);
  }
  target = std::move(read);
  return true;
}

bool Section::words(std::string_view key,
                    std::vector<std::string>& target,
                    std::initializer_list<std::string_view> words) {
  std::vector<std::string> given;
  if (!texts(key, given)) return false;
  for (const TomlValue& item : find(key)->value.items) {
    if (std::ranges::find(words, item.text) == words.end()) {
      faults_->add(item.place, fmt::format("{} holds \"{}\", but knows only {}", full(key),
                                           item.text, joined(words)));
      return false;
    }
  }
  target = std::move(given);
  return true;
}

bool Section::numbers(std::string_view key,
                      std::vector<double>& target,
                      std::initializer_list<std::size_t> lengths,
                      Range range) {
  const TomlValue* value = take(key, Kind::array);
  if (value == nullptr) return false;
  if (lengths.size() > 0 && std::ranges::find(lengths, value->items.size()) == lengths.end()) {
    std::string wanted;
    for (const std::size_t length : lengths) {
      wanted += (wanted.empty() ? "" : " or ") + std::to_string(length);
    }
    fault(key, fmt::format("has {} numbers, but must have {}", value->items.size(), wanted));
    return false;
  }
  std::vector<double> read;
  for (const TomlValue& item : value->items) {
    const std::optional<double> good = checked(key, item, range);
    if (!good) return false;
    read.push_back(*good);
  }
  target = std::move(read);
  return true;
}

bool Section::vector(std::string_view key, calibrate::Vec3& target, Range range) {
  std::vector<double> read;
  if (!numbers(key, read, {3}, range)) return false;
  target = {read[0], read[1], read[2]};
  return true;
}

bool Section::colour(std::string_view key, std::array<float, 3>& target, Range range) {
  const TomlValue* value = take(key);
  if (value == nullptr) return false;
  if (value->kind == Kind::array) {
    std::vector<double> read;
    if (!numbers(key, read, {3}, range)) return false;
    for (std::size_t c = 0; c < 3; ++c) target[c] = static_cast<float>(read[c]);
    return true;
  }
  float grey = 0;
  if (!number(key, grey, range)) return false;
  target.fill(grey);
  return true;
}

bool Section::integers(std::string_view key, std::span<int> target, int low, int high) {
  std::vector<double> read;
  const Range range{static_cast<double>(low), static_cast<double>(high)};
  if (!numbers(key, read, {target.size()}, range)) return false;
  const std::vector<TomlValue>& items = find(key)->value.items;
  if (!std::ranges::all_of(items, [](const TomlValue& v) { return v.kind == Kind::integer; })) {
    fault(key, "must hold whole numbers");
    return false;
  }
  std::ranges::transform(read, target.begin(), [](double v) { return static_cast<int>(v); });
  return true;
}

std::string words_for_missing(const std::filesystem::path& path, std::error_code why) {
  if (why)
    return fmt::format("names {}, which cannot be looked at: {}", path.string(), why.message());
  return fmt::format("names {}, which does not exist", path.string());
}

bool Section::file(std::string_view key, const std::filesystem::path& base, std::string& target) {
  std::string given;
  if (!text(key, given)) return false;
  const std::filesystem::path path = (base / given).lexically_normal();
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    fault(key, words_for_missing(path, error));
    return false;
  }
  target = path.string();
  names(key, target);
  return true;
}

void Section::of_use_only(bool useful, std::string_view key, std::string_view with) {
  if (take(key) != nullptr && !useful) fault(key, fmt::format("is of use only with {}", with));
}

void Section::names(std::string_view key, const std::string& path) {
  faults_->name_file({full(key), path});
}

std::optional<Section> Section::table(std::string_view key) {
  const TomlValue* value = take(key, Kind::table);
  if (value == nullptr) return std::nullopt;
  return Section(*value, full(key), *faults_);
}

std::vector<Section> Section::tables(std::string_view key) {
  std::vector<Section> sections;
  const TomlValue* value = take(key);
  if (value == nullptr) return sections;
  if (value->kind != Kind::array) {
    fault(key, fmt::format("is {}: write [[{}]]", name_of(value->kind), full(key)));
    return sections;
  }
  for (const TomlValue& item : value->items) {
    if (item.kind != Kind::table) {
      faults_->add(item.place,
                   fmt::format("{} must hold tables: write [[{}]]", full(key), full(key)));
      continue;
    }
    sections.emplace_back(item, full(key), *faults_);
  }
  return sections;
}

void Section::need(std::string_view key, std::string_view what_for) {
  if (!has(key)) {
    faults_->add(table_->place, fmt::format("{} is missing: {}", full(key), what_for));
  }
}

void Section::finish() {
  for (const TomlEntry& entry : table_->entries) {
    if (std::ranges::find(known_, entry.key) != known_.end()) continue;
    std::string message = fmt::format("unknown key {}", full(entry.key));
    const auto nearest = std::ranges::min_element(
        known_, {}, [&](const std::string& known) { return edit_distance(known, entry.key); });
    if (nearest != known_.end() && edit_distance(*nearest, entry.key) <= 2) {
      message += fmt::format(": did you mean {}?", *nearest);
    }
    faults_->add(entry.place, std::move(message));
  }
}

}  // namespace studio
