// Set files: the probe's match to the plate.
#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "studio/set_sections.h"

namespace studio {
namespace {

constexpr Range gain_range{1e-9, 1e9};
constexpr Range matrix_range{-1e9, 1e9};

// Row by row; what it makes of grey must stay light.
void read_matrix(Section& section, std::string_view key, MatchSettings& match) {
  std::vector<double> numbers;
  if (!section.numbers(key, numbers, {9}, matrix_range)) return;
  render::ColourMatrix matrix{};
  std::ranges::transform(numbers, matrix.begin(), [](double v) { return static_cast<float>(v); });
  const std::array<float, 3> grey = render::gain_of_grey(matrix);
  for (std::size_t c = 0; c < 3; ++c) {
    if (grey[c] > 0) continue;
    section.fault(key, fmt::format("makes no light of grey light: row {} adds up to {:.6g}, but "
                                   "must be above 0",
                                   c + 1, grey[c]));
    return;
  }
  match.matrix = matrix;
}

void read_patch(Section& table, std::array<int, 2> picture, MatchSettings& match) {
  match.method = MatchSettings::Method::patch;
  table.need("albedo", "what the spot reflects, 0 to 1");
  std::optional<std::array<int, 4>> patch;
  read_rectangle(table, "patch", picture, patch);
  if (patch) match.patch = *patch;
  table.colour("albedo", match.albedo, {0.001, 1});
  table.vector("normal", match.normal, {-1, 1});
  if (calibrate::length(match.normal) < 0.5) table.fault("normal", "must be about of length 1");
}

void read_given(Section& table, MatchSettings& match) {
  match.method = MatchSettings::Method::given;
  table.colour("gain", match.gain, gain_range);
  read_matrix(table, "matrix", match);
  const bool is_fixed =
      table.boolean("follow", match.follow) ? !match.follow : !table.has("follow");
  double exposure_s = 0;
  if (table.number("exposure_s", exposure_s, {1e-9, 3600})) match.exposure_s = exposure_s;
  table.number("overlap", match.overlap, {0.01, 100});
  for (const std::string_view key : {"exposure_s", "overlap"}) {
    if (is_fixed && table.has(key)) table.fault(key, "is of use only with follow = true");
  }
}

}  // namespace

void read_match(Section& section, std::array<int, 2> picture, MatchSettings& match) {
  const TomlValue* given = section.value("match");
  if (given == nullptr) return;
  if (given->kind == TomlValue::Kind::array) {
    match.method = MatchSettings::Method::given;
    std::vector<double> numbers;
    if (given->items.size() == 9) {
      read_matrix(section, "match", match);
    } else if (section.numbers("match", numbers, {3, 9}, gain_range)) {
      section.colour("match", match.gain, gain_range);
    }
  } else if (given->kind == TomlValue::Kind::table) {
    auto table = section.table("match");
    const int ways = int{table->has("patch")} + int{table->has("gain")} + int{table->has("matrix")};
    if (ways != 1) {
      table->fault("",
                   "must have exactly one of gain = [r, g, b], matrix = [nine numbers], "
                   "patch = [x, y, width, height] of a painted spot in the picture");
    }
    const bool patch = table->has("patch");
    const bool given_too = !patch || table->has("gain") || table->has("matrix");
    if (patch) read_patch(*table, picture, match);
    if (given_too) read_given(*table, match);
    for (const std::string_view key : {"albedo", "normal"}) {
      table->of_use_only(patch, key, "patch");
    }
    for (const std::string_view key : {"follow", "exposure_s", "overlap"}) {
      table->of_use_only(given_too, key, "gain or matrix");
    }
    table->finish();
  } else {
    std::string word;
    if (section.text("match", word) && word != "auto") {
      section.fault("match",
                    fmt::format("is \"{}\", but must be \"auto\", the numbers that calibrate "
                                "light gives, or a table of gain, matrix or patch",
                                word));
    }
  }
}

void read_rectangle(Section& section,
                    std::string_view key,
                    std::array<int, 2> picture,
                    std::optional<std::array<int, 4>>& rectangle) {
  std::array<int, 4> given{};
  if (!section.integers(key, given, 0, 65535)) return;
  if (given[2] < 1 || given[3] < 1) {
    section.fault(key, "must be [x, y, width, height] with width and height at least 1");
    return;
  }
  if (picture[0] > 0 && (given[0] + given[2] > picture[0] || given[1] + given[3] > picture[1])) {
    section.fault(key, fmt::format("reaches beyond the picture of {}x{}", picture[0], picture[1]));
    return;
  }
  rectangle = given;
}

}  // namespace studio
