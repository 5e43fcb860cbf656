// Known responses, and those in files.
#include "capture/response.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "capture/colour.h"
#include "capture/files.h"

namespace capture {
namespace {

constexpr std::size_t highest_degree = 20;

double polynomial(const std::vector<double>& highest_first, double z) {
  double value = 0;
  for (const double coefficient : highest_first) value = value * z + coefficient;
  return value;
}

template <class Curve>
Response response_of(std::string name, Curve curve) {
  Response response;
  response.name = std::move(name);
  for (auto& channel : response.light) {
    for (std::size_t z = 0; z < channel.size(); ++z) {
      channel[z] = curve(static_cast<double>(z) / (Response::codes - 1));
    }
  }
  return response;
}

// The numbers of a line, or nothing if there is anything else.
std::optional<std::vector<double>> numbers(std::string_view line) {
  std::vector<double> values;
  const char* at = line.data();
  const char* const end = at + line.size();
  while (true) {
    while (at != end && (*at == ' ' || *at == '\t' || *at == '\r')) ++at;
    if (at == end) return values;
    double value = 0;
    const auto [rest, error] = std::from_chars(at, end, value);
    if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
    values.push_back(value);
    at = rest;
  }
}

std::vector<double> coefficients_of(std::string_view line) {
  const auto values = numbers(line);
  if (!values) throw std::runtime_error("is not made of numbers");
  if (values->empty() || (*values)[0] < 1 || (*values)[0] > highest_degree ||
      std::floor((*values)[0]) != (*values)[0]) {
    throw std::runtime_error("does not begin with a degree of 1 to 20");
  }
  if (static_cast<double>(values->size()) != (*values)[0] + 2) {
    throw std::runtime_error("needs one coefficient more than its degree");
  }
  return {values->begin() + 1, values->end()};
}

// Fills the table from the coefficients; wants a curve that rises to about 1.
void tabulate(const std::vector<double>& coefficients, std::array<double, Response::codes>& light) {
  constexpr double end_tolerance = 0.05;
  constexpr std::size_t dark = 8;  // fitted polynomials may wiggle below
  for (std::size_t z = 0; z < light.size(); ++z) {
    light[z] = polynomial(coefficients, static_cast<double>(z) / (Response::codes - 1));
    if (z > dark && !(light[z] > light[z - 1])) {
      throw std::runtime_error("falls at code " + std::to_string(z));
    }
  }
  if (std::abs(light.back() - 1) > end_tolerance) {
    throw std::runtime_error("ends at " + std::to_string(light.back()) + " instead of 1");
  }
  // Never below the curve's foot: light is not negative.
  for (std::size_t z = dark; z-- > 0;) light[z] = std::max(0.0, std::min(light[z], light[z + 1]));
}

}  // namespace

bool is_sound(const Response& response) {
  constexpr double near_white = 0.05;
  return std::ranges::all_of(response.light, [](const auto& light) {
    return light.front() >= 0 && light.back() > 1 - near_white && light.back() <= 1 + near_white &&
           std::ranges::all_of(light, [](double x) { return std::isfinite(x); }) &&
           std::ranges::is_sorted(light);
  });
}

Response srgb_response() {
  return response_of("sRGB", [](double z) { return decode(Transfer::srgb, z); });
}

Response linear_response() {
  return response_of("linear", [](double z) { return z; });
}

Response read_rsp(const std::string& path) {
  constexpr std::size_t most_bytes = 1 << 16;
  const std::vector<std::byte> bytes = read_file(path, most_bytes);
  std::istringstream text(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  Response response;
  response.name = path;
  std::size_t channel = 0;
  int line_number = 0;
  for (std::string line; std::getline(text, line);) {
    ++line_number;
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    try {
      if (channel == response.light.size()) throw std::runtime_error("is a fourth channel");
      response.coefficients[channel] = coefficients_of(line);
      tabulate(response.coefficients[channel], response.light[channel]);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(path + ":" + std::to_string(line_number) + ": the line " +
                               error.what());
    }
    ++channel;
  }
  if (channel == 1) {
    for (std::size_t c = 1; c < response.light.size(); ++c) {
      response.coefficients[c] = response.coefficients[0];
      response.light[c] = response.light[0];
    }
  } else if (channel != response.light.size()) {
    throw std::runtime_error(path + ": has " + std::to_string(channel) +
                             " channels; a response file has one line, or three");
  }
  return response;
}

void write_rsp(const std::string& path, const Response& response) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(15);
  for (const std::vector<double>& coefficients : response.coefficients) {
    if (coefficients.size() < 2) {
      throw std::invalid_argument("the response " + response.name +
                                  " is no polynomial; a .rsp file holds only these");
    }
    text << coefficients.size() - 1;
    for (const double coefficient : coefficients) text << ' ' << coefficient;
    text << '\n';
  }
  write_file(path, std::as_bytes(std::span<const char>(text.str())));
}

}  // namespace capture
