// Reads one table of a set file, key by key, and notes every fault with its place.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calibrate/vec.h"
#include "studio/toml.h"

namespace studio {

// One fault of a file, for people and editors.
struct Diagnostic {
  std::string file;
  int line = 0;  // from 1; 0 = the file as a whole
  int column = 0;
  std::string message;
  friend bool operator==(const Diagnostic&, const Diagnostic&) = default;
};

// "FILE:LINE:COLUMN: MESSAGE", or "FILE: MESSAGE" without a place.
std::string to_string(const Diagnostic& diagnostic);

// A file that another one names: by which key, and where it is.
struct NamedFile {
  std::string key, path;
};

// The faults found so far in one file, and what other files it names.
class Faults {
 public:
  explicit Faults(std::string file) : file_(std::move(file)) {}
  void add(Place place, std::string message) {
    diagnostics_.push_back({file_, place.line, place.column, std::move(message)});
  }
  // In the order of the file.
  std::vector<Diagnostic> sorted() const;

  void name_file(NamedFile file) { named_.push_back(std::move(file)); }
  const std::vector<NamedFile>& named() const { return named_; }

 private:
  std::string file_;
  std::vector<NamedFile> named_;
  std::vector<Diagnostic> diagnostics_;
};

struct Range {
  double low = -std::numeric_limits<double>::max();
  double high = std::numeric_limits<double>::max();
};

// What to say of a path that is not there, or, by `why`, cannot be looked at.
std::string words_for_missing(const std::filesystem::path& path, std::error_code why);

// Every reading function returns true and sets its target if the key is there and good; a key that
// is there and bad leaves the target alone and adds a fault. finish() then names unknown keys.
// Names in messages are "SECTION.key". The table must outlive the section.
class Section {
 public:
  Section(const TomlValue& table, std::string name, Faults& faults);

  const std::string& name() const { return name_; }
  Place place() const { return table_->place; }
  bool has(std::string_view key) const { return find(key) != nullptr; }
  // Of the key's value; of the section if there is no such key.
  Place place_of(std::string_view key) const;

  bool boolean(std::string_view key, bool& target);
  bool integer(std::string_view key, int& target, int low, int high);
  bool integer(std::string_view key, std::int64_t& target, std::int64_t low, std::int64_t high);
  bool number(std::string_view key, double& target, Range range = {});
  bool number(std::string_view key, float& target, Range range = {});
  bool text(std::string_view key, std::string& target);
  // One of a few words.
  bool word(std::string_view key, std::string& target, std::span<const std::string_view> words);
  bool word(std::string_view key,
            std::string& target,
            std::initializer_list<std::string_view> words) {
    return word(key, target, std::span(words.begin(), words.size()));
  }
  bool words(std::string_view key,
             std::vector<std::string>& target,
             std::initializer_list<std::string_view> words);
  bool texts(std::string_view key, std::vector<std::string>& target);
  // Lists of numbers whose length is one of `lengths` (any, if empty).
  bool numbers(std::string_view key,
               std::vector<double>& target,
               std::initializer_list<std::size_t> lengths,
               Range range = {});
  bool vector(std::string_view key, calibrate::Vec3& target, Range range = {});
  // A number for all three channels, or one for each.
  bool colour(std::string_view key, std::array<float, 3>& target, Range range);
  // Exactly as many whole numbers as `target` holds.
  bool integers(std::string_view key, std::span<int> target, int low, int high);
  // The file or directory that a path names, made absolute; relative ones start at `base`.
  bool file(std::string_view key, const std::filesystem::path& base, std::string& target);
  // Tells of a file that the key's value leads to.
  void names(std::string_view key, const std::string& path);

  // A table inside this one; nothing if it is absent or no table.
  std::optional<Section> table(std::string_view key);
  // The tables of [[key]].
  std::vector<Section> tables(std::string_view key);
  // The value as it stands, counted as read.
  const TomlValue* value(std::string_view key);

  void fault(std::string_view key, const std::string& message);
  // Adds a fault unless the key is there.
  void need(std::string_view key, std::string_view what_for);
  // Adds a fault if the key is there and would do nothing, `useful` being false. Counts as reading
  // it: keys that belong to something else are no unknown ones.
  void of_use_only(bool useful, std::string_view key, std::string_view with);
  // Faults for keys that nothing asked for.
  void finish();

 private:
  const TomlEntry* find(std::string_view key) const;
  const TomlValue* take(std::string_view key);
  const TomlValue* take(std::string_view key, TomlValue::Kind kind);
  std::optional<double> checked(std::string_view key, const TomlValue& value, Range range);
  std::string full(std::string_view key) const;

  const TomlValue* table_;
  std::string name_;
  Faults* faults_;
  std::vector<std::string> known_;
};

}  // namespace studio
