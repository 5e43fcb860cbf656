// Set files: lenses.
#include <algorithm>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include "studio/set_sections.h"

namespace studio {
namespace {

constexpr Range focal_range{1e-3, 1e7};
constexpr Range centre_range{-1e6, 1e6};
constexpr Range term_range{-1e6, 1e6};

// fx and fy: from one number for both, or a list of two.
std::vector<double> read_focal(Section& table) {
  table.need("focal_px", "the focal length in pixels");
  const TomlValue* given = table.value("focal_px");
  std::vector<double> focal;
  if (given != nullptr && given->kind == TomlValue::Kind::array) {
    table.numbers("focal_px", focal, {2}, focal_range);
  } else if (double both = 0; table.number("focal_px", both, focal_range)) {
    focal = {both, both};
  }
  return focal;
}

// The lens of the keys in `table`, which may hold others too.
std::optional<calibrate::Lens> read_lens_keys(Section& table, std::array<int, 2> size) {
  calibrate::Lens lens;
  lens.width = size[0];
  lens.height = size[1];
  const bool has_model = table.text("model", lens.model);
  table.need("model",
             "pinhole, equisolid, kannala_brandt, decentred_kannala_brandt, or one of mrcal's "
             "LENSMODEL_...");
  if (double max_angle_deg = 180; table.number("max_angle", max_angle_deg, {0.01, 180})) {
    lens.max_angle_rad = std::min(max_angle_deg * std::numbers::pi / 180, std::numbers::pi);
  }
  table.number("error_px", lens.error_px, {0, 1e4});
  if (std::array<int, 2> whole{}; table.integers("size", whole, 1, 65536)) {
    lens.width = whole[0];
    lens.height = whole[1];
  } else if (lens.width < 1) {
    table.need("size", "[width, height] of the picture that the lens makes, before any crop");
  }

  const bool of_mrcal = lens.model.starts_with("LENSMODEL_");
  const bool decentred = lens.model == "decentred_kannala_brandt";
  const bool has_terms = decentred || lens.model == "kannala_brandt";
  const bool any = !has_model;  // a fault already
  table.of_use_only(any || of_mrcal, "parameters", "mrcal's models, LENSMODEL_...");
  for (const std::string_view key : {"focal_px", "centre"}) {
    table.of_use_only(any || !of_mrcal, key, "models other than mrcal's, which have parameters");
  }
  table.of_use_only(any || has_terms, "k",
                    "model = \"kannala_brandt\" or \"decentred_kannala_brandt\"");
  table.of_use_only(any || decentred, "p", "model = \"decentred_kannala_brandt\"");
  if (of_mrcal) {
    table.need("parameters", "the list of numbers that mrcal's model takes");
    if (table.numbers("parameters", lens.parameters, {}, {-1e9, 1e9}) && lens.parameters.empty()) {
      table.fault("parameters", "is an empty list: every lens has parameters");
    }
  } else {
    std::vector<double> centre{(lens.width - 1) / 2.0, (lens.height - 1) / 2.0};
    std::vector<double> terms;
    const std::vector<double> focal = read_focal(table);
    table.numbers("centre", centre, {2}, centre_range);
    std::vector<double> decentring(decentred ? 2 : 0);
    if (decentred) table.numbers("p", decentring, {2}, term_range);
    if (has_terms) table.numbers("k", terms, {0, 1, 2, 3, 4}, term_range);
    if (focal.empty()) return std::nullopt;
    lens.parameters = focal;
    if (lens.model == "equisolid") {
      if (focal.front() != focal.back()) table.fault("focal_px", "is one number of this lens");
      lens.parameters.pop_back();
    }
    lens.parameters.insert(lens.parameters.end(), centre.begin(), centre.end());
    lens.parameters.insert(lens.parameters.end(), decentring.begin(), decentring.end());
    lens.parameters.insert(lens.parameters.end(), terms.begin(), terms.end());
  }
  if (!has_model || lens.parameters.empty() || lens.width < 1) return std::nullopt;
  try {
    check(lens);
  } catch (const std::invalid_argument& error) {
    table.fault("model", fmt::format("\"{}\": {}", lens.model, error.what()));
    return std::nullopt;
  }
  return lens;
}

}  // namespace

void refuse_lens_keys(Section& section, const std::string& why) {
  for (const std::string_view key :
       {"model", "focal_px", "centre", "k", "p", "max_angle", "error_px", "parameters", "size"}) {
    if (section.value(key) != nullptr) section.fault(key, why);
  }
}

std::optional<calibrate::Lens> read_lens_key(Section& section,
                                             std::array<int, 2> size,
                                             const std::filesystem::path& base,
                                             std::string* file) {
  if (!section.has("lens") && section.has("model")) return read_lens_keys(section, size);
  refuse_lens_keys(section, section.has("lens") ? "is of another lens: leave out either it or lens"
                                                : "is of use only with model");
  if (!section.has("lens")) return std::nullopt;
  const TomlValue* given = section.value("lens");
  if (given->kind == TomlValue::Kind::table) {
    auto table = section.table("lens");
    auto lens = read_lens_keys(*table, size);
    table->finish();
    return lens;
  }
  std::string path;
  if (!section.file("lens", base, path)) return std::nullopt;
  if (file != nullptr) *file = path;
  try {
    return calibrate::read_lens(path);
  } catch (const std::runtime_error& error) {
    section.fault("lens", fmt::format("cannot be used: {}", error.what()));
    return std::nullopt;
  }
}

}  // namespace studio
