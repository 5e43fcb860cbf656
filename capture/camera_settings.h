// What live cameras' URIs have in common: DEVICE?key=value&key=value.
#pragma once

#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "capture/frame.h"

namespace capture {

struct CameraSetting {
  std::string key;
  std::string value;
};

struct CameraSettings {
  std::string device;                   // what stands before the question mark
  std::vector<CameraSetting> settings;  // in the order given
};

// Of what follows a scheme's colon. Throws std::runtime_error, without the URI, if one of the
// settings is none.
CameraSettings parse_settings(std::string_view rest);

struct PictureSize {
  int width = 0;
  int height = 0;
  friend bool operator==(const PictureSize&, const PictureSize&) = default;
};

// All of a text as a number; nothing if it is none.
template <class Number>
std::optional<Number> number_in(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// "640x480"; nothing if it is no size, or larger than any picture.
std::optional<PictureSize> size_in(std::string_view text);
// A whole number, a decimal one or a fraction of frames a second; nothing if it is no rate.
std::optional<Rational> rate_in(std::string_view text);

// "640x480", "30", "29.97": for people.
std::string words_of(PictureSize size);
std::string words_of(Rational rate);

}  // namespace capture
