// Files of camera responses.
#include "capture/camera_response.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <set>
#include <span>
#include <sstream>
#include <stdexcept>

#include <toml++/toml.h>

#include "capture/files.h"
#include "capture/toml_reader.h"

namespace capture {
namespace {

constexpr std::array<std::string_view, 3> colours{"red", "green", "blue"};

bool ends_as(const std::string& path, std::string_view ending) { return path.ends_with(ending); }

// A response file while it is read: what is not taken in the end is unknown.
class ResponseTable : private TomlReader {
 public:
  ResponseTable(const TomlReader& reader, const toml::table& table, std::string inside = {})
      : TomlReader(reader), table_(table), inside_(std::move(inside)) {}

  std::string text(std::string_view key) {
    const toml::node& node = take(key);
    const auto value = node.value_exact<std::string>();
    if (!value) fail(node.source(), named(key) + " must be a string");
    return *value;
  }

  double number(std::string_view key, double low, double high) {
    const toml::node& node = take(key);
    return number_of(node, key, low, high);
  }

  // Exactly as many as `to`.
  void numbers(std::string_view key, double low, double high, std::span<double> to) {
    const toml::node& node = take(key);
    const toml::array* array = node.as_array();
    if (array == nullptr || array->size() != to.size()) {
      fail(node.source(),
           named(key) + " must be a list of " + std::to_string(to.size()) + " numbers");
    }
    for (std::size_t i = 0; i < to.size(); ++i) to[i] = number_of((*array)[i], key, low, high);
  }

  ResponseTable table(std::string_view key) {
    const toml::node& node = take(key);
    if (!node.is_table()) fail(node.source(), named(key) + " must be a table");
    return {*this, *node.as_table(), std::string(key) + "."};
  }

  void refuse_unknown() const {
    for (const auto& [key, node] : table_) {
      if (taken_.contains(std::string(key.str()))) continue;
      fail(key.source(), "there is no key " + named(key.str()));
    }
  }

  [[noreturn]] void fail_at(std::string_view key, const std::string& why) const {
    fail(table_.get(key)->source(), named(key) + " " + why);
  }

 private:
  std::string named(std::string_view key) const { return in_quotes(inside_ + std::string(key)); }
  const toml::node& take(std::string_view key) {
    const toml::node* node = table_.get(key);
    if (node == nullptr) fail(table_.source(), "the key " + named(key) + " is missing");
    taken_.emplace(key);
    return *node;
  }
  double number_of(const toml::node& node, std::string_view key, double low, double high) const {
    const auto value = node.value<double>();
    if (!node.is_number() || !value || !(*value >= low && *value <= high)) {
      std::ostringstream range;
      range << " must be made of numbers from " << low << " to " << high;
      fail(node.source(), named(key) + range.str());
    }
    return *value;
  }

  const toml::table& table_;
  std::string inside_;
  std::set<std::string> taken_;
};

// Light of 8-bit codes, for what reads only these.
Response curve_of(const LinearResponse& linear) {
  Response curve;
  curve.name = "linear";
  for (std::size_t c = 0; c < curve.light.size(); ++c) {
    const double range = linear.white[c] - linear.black[c];
    for (std::size_t z = 0; z < curve.light[c].size(); ++z) {
      const double code = static_cast<double>(z) / (Response::codes - 1) * linear.full_code;
      curve.light[c][z] = std::clamp((code - linear.black[c]) / range, 0.0, 1.0);
    }
  }
  return curve;
}

CameraResponse read_linear(ResponseTable& table) {
  constexpr double most_code = 65535;
  LinearResponse linear;
  linear.full_code = table.number("full_code", 1, most_code);
  table.numbers("black", -most_code, most_code, linear.black);
  table.numbers("white", -most_code, most_code, linear.white);
  table.numbers("gain", 0, 1e9, linear.gain);
  table.numbers("read_noise", 0, most_code, linear.read_noise);
  for (std::size_t c = 0; c < 3; ++c) {
    if (!(linear.white[c] > linear.black[c])) table.fail_at("white", "must be above \"black\"");
  }
  ResponseTable noise = table.table("noise");
  linear.noise = {.read = noise.number("read", 0, 1),
                  .shot = noise.number("shot", 0, 1),
                  .relative = 0,
                  .saturation = noise.number("saturation", 0.01, 1)};
  noise.refuse_unknown();
  return {curve_of(linear), linear};
}

CameraResponse read_curve(ResponseTable& table) {
  CameraResponse response;
  response.curve.name = table.text("name");
  constexpr double near_white = 0.05;
  for (std::size_t c = 0; c < colours.size(); ++c) {
    auto& light = response.curve.light[c];
    table.numbers(colours[c], 0, 1 + near_white, light);
    const auto fall = std::is_sorted_until(light.begin(), light.end());
    if (fall != light.end()) {
      table.fail_at(colours[c], "falls at code " + std::to_string(fall - light.begin()));
    }
    if (!(light.back() > 1 - near_white)) table.fail_at(colours[c], "must end near 1");
  }
  return response;
}

CameraResponse read_toml(const std::string& path) {
  constexpr std::size_t most_bytes = 1 << 18;
  const TomlReader reader(path, "response");
  const toml::table parsed = reader.parse(most_bytes);
  ResponseTable table(reader, parsed);
  const std::string model = table.text("model");
  if (model != "linear" && model != "curve") {
    table.fail_at("model", "must be \"linear\" or \"curve\"");
  }
  CameraResponse response = model == "linear" ? read_linear(table) : read_curve(table);
  table.refuse_unknown();
  return response;
}

template <class Numbers>
std::string list_of(const Numbers& numbers) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(9);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    constexpr std::size_t in_a_line = 8;
    text << (i == 0 ? "[" : i % in_a_line == 0 ? ",\n  " : ", ") << numbers[i];
  }
  text << "]\n";
  return text.str();
}

std::string toml_of(const CameraResponse& response) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(9);
  text << "# Of platelight calibrate response.\n";
  if (response.linear) {
    const LinearResponse& linear = *response.linear;
    text << "model = \"linear\"\nfull_code = " << linear.full_code
         << "  # the code of value 1\nblack = " << list_of(linear.black)
         << "white = " << list_of(linear.white) << "gain = " << list_of(linear.gain)
         << "read_noise = " << list_of(linear.read_noise)
         << "[noise]  # variance of light: read + shot * light\nread = " << linear.noise.read
         << "\nshot = " << linear.noise.shot << "\nsaturation = " << linear.noise.saturation
         << "\n";
    return text.str();
  }
  text << "model = \"curve\"\nname = \"";
  for (const char c : response.curve.name) {
    if (c != '"' && c != '\\' && static_cast<unsigned char>(c) >= ' ') text << c;
  }
  text << "\"\n";
  for (std::size_t c = 0; c < colours.size(); ++c) {
    text << colours[c] << " = " << list_of(response.curve.light[c]);
  }
  return text.str();
}

// Light between the codes on straight lines, which go on beyond the first and last code.
double interpolated(const std::array<double, Response::codes>& light, double value) {
  constexpr int last_step = Response::codes - 2;
  const double code = value * (Response::codes - 1);
  const int below =
      static_cast<int>(std::clamp(std::floor(code), 0.0, static_cast<double>(last_step)));
  const auto i = static_cast<std::size_t>(below);
  return light[i] + (code - below) * (light[i + 1] - light[i]);
}

}  // namespace

double CameraResponse::light(int channel, double value) const {
  const auto c = static_cast<std::size_t>(channel);
  if (!linear) return interpolated(curve.light[c], value);
  return (value * linear->full_code - linear->black[c]) / (linear->white[c] - linear->black[c]);
}

CameraResponse response_of(const PhotonTransfer& transfer, double full_code) {
  LinearResponse linear;
  linear.full_code = full_code;
  linear.noise = transfer.noise();
  for (std::size_t c = 0; c < 3; ++c) {
    const ChannelTransfer& channel = transfer.channels[transfer.channels.size() == 3 ? c : 0];
    linear.black[c] = channel.black.value;
    linear.white[c] = channel.saturation;
    linear.gain[c] = channel.gain.value;
    linear.read_noise[c] = channel.read_noise.value;
  }
  return {curve_of(linear), linear};
}

CameraResponse read_response(const std::string& path) {
  if (ends_as(path, ".toml")) return read_toml(path);
  return {read_rsp(path), std::nullopt};
}

void write_response(const std::string& path, const CameraResponse& response) {
  if (!response.linear && !is_sound(response.curve)) {
    throw std::invalid_argument(path + ": its curve falls somewhere, or does not end near 1, and " +
                                "would not be read back; are the exposures in the shots' order?");
  }
  if (ends_as(path, ".toml")) {
    write_file(path, std::as_bytes(std::span<const char>(toml_of(response))));
    return;
  }
  if (!ends_as(path, ".rsp")) {
    throw std::invalid_argument(path + ": a response is written to a .toml or a .rsp file");
  }
  if (response.linear) {
    throw std::invalid_argument(
        path + ": a .rsp file has no place for black level and noise; name a .toml file");
  }
  write_rsp(path, response.curve);
}

}  // namespace capture
