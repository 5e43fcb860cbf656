// JPEG files that tell how they were exposed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace made {

using ExifBytes = std::vector<std::byte>;

inline void append(ExifBytes& bytes, std::uint32_t value, int count) {  // big-endian
  for (int i = count - 1; i >= 0; --i) bytes.push_back(static_cast<std::byte>(value >> (8 * i)));
}

// The start of a JPEG file with EXIF data: exposure time, f-number and ISO, as numbers or ratios;
// an f-number of 0 tells none, nor does an ISO of 0.
inline ExifBytes made_exif(std::uint32_t seconds,
                           std::uint32_t per,
                           std::uint32_t f_number_tenths,
                           std::uint16_t iso) {
  constexpr std::uint32_t exif_offset = 26;
  constexpr std::uint32_t ratios_offset = exif_offset + 2 + 3 * 12 + 4;
  ExifBytes tiff;
  append(tiff, 0x4D4D002A, 4);
  append(tiff, 8, 4);
  append(tiff, 1, 2);
  append(tiff, 0x87690004, 4);  // pointer to the EXIF directory
  append(tiff, 1, 4);
  append(tiff, exif_offset, 4);
  append(tiff, 0, 4);
  append(tiff, 3, 2);
  append(tiff, 0x829A0005, 4);  // exposure time
  append(tiff, 1, 4);
  append(tiff, ratios_offset, 4);
  append(tiff, 0x829D0005, 4);  // f-number
  append(tiff, 1, 4);
  append(tiff, ratios_offset + 8, 4);
  append(tiff, 0x88270003, 4);  // ISO
  append(tiff, 1, 4);
  append(tiff, std::uint32_t{iso} << 16, 4);
  append(tiff, 0, 4);
  for (const std::uint32_t number : {seconds, per, f_number_tenths, std::uint32_t{10}}) {
    append(tiff, number, 4);
  }
  ExifBytes file;
  append(file, 0xFFD8FFE1, 4);
  append(file, static_cast<std::uint32_t>(tiff.size() + 8), 2);
  for (const char c : {'E', 'x', 'i', 'f', '\0', '\0'}) file.push_back(static_cast<std::byte>(c));
  file.insert(file.end(), tiff.begin(), tiff.end());
  append(file, 0xFFD9, 2);
  return file;
}

}  // namespace made
