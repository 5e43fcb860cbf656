// Settings of live cameras.
#include "capture/camera_settings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "capture/libav.h"

namespace capture {

CameraSettings parse_settings(std::string_view rest) {
  const std::size_t mark = rest.find('?');
  CameraSettings parsed{std::string(rest.substr(0, mark)), {}};
  std::string_view settings = mark == rest.npos ? "" : rest.substr(mark + 1);
  while (!settings.empty()) {
    const std::size_t end = std::min(settings.find('&'), settings.size());
    const std::string_view setting = settings.substr(0, end);
    settings.remove_prefix(std::min(end + 1, settings.size()));
    const std::size_t equals = setting.find('=');
    if (equals == setting.npos || equals == 0) {
      throw std::runtime_error("\"" + std::string(setting) + "\" is no setting");
    }
    parsed.settings.push_back(
        {std::string(setting.substr(0, equals)), std::string(setting.substr(equals + 1))});
  }
  return parsed;
}

std::optional<PictureSize> size_in(std::string_view text) {
  const std::size_t by = text.find('x');
  const auto width = number_in<int>(text.substr(0, by));
  const auto height = by == text.npos ? std::nullopt : number_in<int>(text.substr(by + 1));
  if (!width || !height || *width < 1 || *height < 1 || *width > libav::max_side ||
      *height > libav::max_side) {
    return std::nullopt;
  }
  return PictureSize{*width, *height};
}

std::optional<Rational> rate_in(std::string_view text) {
  constexpr std::int64_t most = 1'000'000;
  const std::size_t slash = text.find('/');
  const auto over = slash == text.npos ? std::optional<std::int64_t>(1)
                                       : number_in<std::int64_t>(text.substr(slash + 1));
  if (const auto whole = number_in<std::int64_t>(text.substr(0, slash));
      whole && over && *whole > 0 && *whole <= most && *over > 0 && *over <= most) {
    return Rational{*whole, *over};
  }
  const auto decimal = number_in<double>(text);
  if (!decimal || !(*decimal >= 0.001 && *decimal <= 1000)) return std::nullopt;
  return Rational{std::llround(1000 * *decimal), 1000};
}

std::string words_of(PictureSize size) {
  return std::to_string(size.width) + "x" + std::to_string(size.height);
}

std::string words_of(Rational rate) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.5g", rate.value());
  return text.data();
}

}  // namespace capture
