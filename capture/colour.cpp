// The curves between codes and light.
#include "capture/colour.h"

#include <cmath>
#include <stdexcept>
#include <utility>

namespace capture {
namespace {

constexpr std::array<std::pair<Transfer, std::string_view>, 4> names{{
    {Transfer::rec1886, "Rec.1886"},
    {Transfer::srgb, "sRGB"},
    {Transfer::rec709_camera, "Rec.709 camera"},
    {Transfer::linear, "linear"},
}};

constexpr double rec1886_power = 2.4;

// IEC 61966-2-1. The break in light follows from the break in value, so that encode undoes decode
// on both sides of it.
constexpr double srgb_break_value = 0.04045;
constexpr double srgb_slope = 12.92;
constexpr double srgb_offset = 0.055;
constexpr double srgb_power = 2.4;

// Recommendations BT.709-6 and BT.2020-2, 1.2: the constants in full, with which the line meets the
// power without a step (1.099 and 0.018 are these, rounded).
constexpr double rec709_break_light = 0.018053968510807;
constexpr double rec709_slope = 4.5;
constexpr double rec709_offset = 0.09929682680944;
constexpr double rec709_power = 0.45;

double decode_positive(Transfer transfer, double value) {
  switch (transfer) {
    case Transfer::rec1886:
      return std::pow(value, rec1886_power);
    case Transfer::srgb:
      return value <= srgb_break_value
                 ? value / srgb_slope
                 : std::pow((value + srgb_offset) / (1 + srgb_offset), srgb_power);
    case Transfer::rec709_camera:
      return value <= rec709_slope * rec709_break_light
                 ? value / rec709_slope
                 : std::pow((value + rec709_offset) / (1 + rec709_offset), 1 / rec709_power);
    case Transfer::linear:
      return value;
  }
  throw std::invalid_argument("no such transfer");
}

double encode_positive(Transfer transfer, double light) {
  switch (transfer) {
    case Transfer::rec1886:
      return std::pow(light, 1 / rec1886_power);
    case Transfer::srgb:
      return light <= srgb_break_value / srgb_slope
                 ? light * srgb_slope
                 : (1 + srgb_offset) * std::pow(light, 1 / srgb_power) - srgb_offset;
    case Transfer::rec709_camera:
      return light <= rec709_break_light
                 ? light * rec709_slope
                 : (1 + rec709_offset) * std::pow(light, rec709_power) - rec709_offset;
    case Transfer::linear:
      return light;
  }
  throw std::invalid_argument("no such transfer");
}

}  // namespace

double decode(Transfer transfer, double value) {
  return std::copysign(decode_positive(transfer, std::abs(value)), value);
}

double encode(Transfer transfer, double light) {
  return std::copysign(encode_positive(transfer, std::abs(light)), light);
}

Transfer transfer_from_name(std::string_view name) {
  std::string known;
  for (const auto& [transfer, its_name] : names) {
    if (its_name == name) {
      return transfer;
    }
    known += known.empty() ? "" : ", ";
    known += '"' + std::string(its_name) + '"';
  }
  throw std::invalid_argument("no colour is called \"" + std::string(name) + "\"; there are " +
                              known);
}

std::string_view name_of(Transfer transfer) {
  for (const auto& [its_transfer, name] : names) {
    if (its_transfer == transfer) {
      return name;
    }
  }
  throw std::invalid_argument("no such transfer");
}

}  // namespace capture
