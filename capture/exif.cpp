// EXIF through libexif.
#include "capture/exif.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include <libexif/exif-data.h>

#include "capture/files.h"

namespace capture {
namespace {

// A mark, in seconds where it is 1 or longer and in 1/seconds where it is shorter, and the exponent
// of two that it stands for.
struct Mark {
  double shown;
  double exponent;
};

constexpr double third = 1.0 / 3;

// ISO 2721 and the cameras' own marks. Those from 0.3 s to 0.8 s are shown as decimals.
constexpr std::array marks{
    Mark{0.3, -2 + third},
    Mark{0.4, -1 - third},
    Mark{0.5, -1},
    Mark{0.6, -1 + third},
    Mark{0.7, -0.5},
    Mark{0.8, -third},
    Mark{1, 0},
    Mark{1.3, third},
    Mark{1.5, 0.5},
    Mark{1.6, 1 - third},
    Mark{2, 1},
    Mark{2.5, 1 + third},
    Mark{3, 1.5},
    Mark{3.2, 2 - third},
    Mark{4, 2},
    Mark{5, 2 + third},
    Mark{6, 3 - third},
    Mark{8, 3},
    Mark{10, 3 + third},
    Mark{13, 4 - third},
    Mark{15, 4},
    Mark{20, 4 + third},
    Mark{25, 5 - third},
    Mark{30, 5},
    Mark{40, 5 + third},
    Mark{45, 5.5},
    Mark{50, 6 - third},
    Mark{60, 6},
    Mark{80, 6 + third},
    Mark{90, 6.5},
    Mark{100, 7 - third},
    Mark{125, 7},
    Mark{160, 7 + third},
    Mark{180, 7.5},
    Mark{200, 8 - third},
    Mark{250, 8},
    Mark{320, 8 + third},
    Mark{350, 8.5},
    Mark{400, 9 - third},
    Mark{500, 9},
    Mark{640, 9 + third},
    Mark{750, 9.5},
    Mark{800, 10 - third},
    Mark{1000, 10},
    Mark{1250, 10 + third},
    Mark{1500, 10.5},
    Mark{1600, 11 - third},
    Mark{2000, 11},
    Mark{2500, 11 + third},
    Mark{3000, 11.5},
    Mark{3200, 12 - third},
    Mark{4000, 12},
    Mark{5000, 12 + third},
    Mark{6000, 12.5},
    Mark{6400, 13 - third},
    Mark{8000, 13},
};
// The longest mark in seconds, and the first one in 1/seconds.
constexpr double slowest = 60;
constexpr double first_fast = 4;

constexpr double tolerance = 0.005;  // EXIF rationals such as 0.3 = 3/10 or 10/33 are inexact

const Mark* nearest_mark(double shown) {
  for (const Mark& mark : marks) {
    if (std::abs(shown / mark.shown - 1) < tolerance) return &mark;
  }
  return nullptr;
}

double snapped_f_number(double marked) {
  constexpr double tolerance_stops = 0.09;  // of area: f/22 means f/22.6
  const double stops = 2 * std::log2(marked);
  const double snapped = std::round(stops * 3) / 3;
  return std::abs(snapped - stops) < tolerance_stops ? std::exp2(snapped / 2) : marked;
}

using ExifDataOwner = std::unique_ptr<ExifData, void (*)(ExifData*)>;

double positive(double value) { return std::isfinite(value) && value > 0 ? value : 0; }

// A rational entry, or 0.
double ratio_in(ExifData* data, ExifTag tag) {
  ExifEntry* entry = exif_content_get_entry(data->ifd[EXIF_IFD_EXIF], tag);
  constexpr unsigned rational_bytes = 8;
  if (entry == nullptr || entry->format != EXIF_FORMAT_RATIONAL || entry->components < 1 ||
      entry->size < rational_bytes) {
    return 0;
  }
  const ExifRational ratio = exif_get_rational(entry->data, exif_data_get_byte_order(data));
  return ratio.denominator == 0 ? 0 : positive(double{1} * ratio.numerator / ratio.denominator);
}

double short_in(ExifData* data, ExifTag tag) {
  ExifEntry* entry = exif_content_get_entry(data->ifd[EXIF_IFD_EXIF], tag);
  if (entry == nullptr || entry->format != EXIF_FORMAT_SHORT || entry->components < 1 ||
      entry->size < 2) {
    return 0;
  }
  return exif_get_short(entry->data, exif_data_get_byte_order(data));
}

}  // namespace

ShotSettings shot_settings(std::span<const std::byte> file_bytes) {
  const auto size = std::min<std::size_t>(file_bytes.size(), std::numeric_limits<unsigned>::max());
  const ExifDataOwner data(
      exif_data_new_from_data(reinterpret_cast<const unsigned char*>(file_bytes.data()),
                              static_cast<unsigned>(size)),
      &exif_data_unref);
  if (!data) return {};
  return {ratio_in(data.get(), EXIF_TAG_EXPOSURE_TIME), ratio_in(data.get(), EXIF_TAG_FNUMBER),
          short_in(data.get(), EXIF_TAG_ISO_SPEED_RATINGS)};
}

double snapped_exposure_s(double marked_s) {
  if (!(marked_s > 0) || !std::isfinite(marked_s)) {
    throw std::invalid_argument("an exposure time is above 0");
  }
  const double fast = 1 / marked_s;
  if (marked_s < slowest * (1 + tolerance)) {
    if (const Mark* mark = nearest_mark(marked_s)) return std::exp2(mark->exponent);
  }
  if (fast > first_fast * (1 - tolerance)) {
    if (const Mark* mark = nearest_mark(fast)) return std::exp2(-mark->exponent);
  }
  return marked_s;
}

double exposure_value(const ShotSettings& settings) {
  const double f_number = settings.f_number > 0 ? snapped_f_number(settings.f_number) : 1;
  const double gain = settings.iso > 0 ? settings.iso / 100 : 1;
  return snapped_exposure_s(settings.exposure_s) / (f_number * f_number) * gain;
}

double exposure_s_of(const std::string& path) {
  const ShotSettings settings = shot_settings(read_file(path));
  if (settings.exposure_s == 0) {
    throw std::runtime_error(path + ": has no exposure time in its EXIF data; state it");
  }
  return snapped_exposure_s(settings.exposure_s);
}

}  // namespace capture
