// The values in a file of OpenCV's FileStorage, and in YAML of its kind.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace calibrate {

// A value that holds no others.
struct StoredValue {
  std::string key;   // with those around it: "camera_matrix/data"; of list items "_"
  std::string text;  // without quotes and brackets
  int line = 0;
};

// What .yml, .yaml (YAML 1.0 as OpenCV writes it: block mappings, flow lists, no anchors) and .xml
// files of at most 4 MB hold. OpenCV's own reader is not asked: it is not made for files that
// someone may have damaged. Throws std::runtime_error with path, line and reason.
class OpencvStorage {
 public:
  explicit OpencvStorage(const std::string& path);

  const std::string& path() const { return path_; }
  // Null if it is not there. Throws if it is there twice.
  const StoredValue* find(std::string_view key) const;
  // Whether it, or something below it, is there.
  bool has(std::string_view key) const;
  // Of the outermost values.
  std::vector<std::string> top_keys() const;
  // The values below a key, at any depth.
  std::vector<StoredValue> values_below(std::string_view key) const;

  [[noreturn]] void fail(int line, const std::string& why) const;

 private:
  void parse_yaml(std::string_view text);
  void parse_xml(std::string_view text);
  void keep(const std::vector<std::string>& keys, std::string text, int line);

  std::string path_;
  std::vector<StoredValue> values_;
};

}  // namespace calibrate
