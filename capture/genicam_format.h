// Pixel formats as GenICam cameras name them, and the same as V4L2 does.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace capture {

// How several codes share bytes, without a gap at the rows' ends.
enum class GenicamPacking {
  none,    // bytes, or words of 16 bits with the code in the low ones
  gige10,  // 2 codes in 3 bytes: the first's upper 8 bits, the lower 2 of both, the second's upper
           // 8
  gige12,  // the same with the lower 4
  lsb10,   // bit after bit, the lowest first: 4 codes in 5 bytes
  lsb12,   // 2 codes in 3 bytes
};

struct GenicamFormat {
  std::string_view name;     // of the Pixel Format Naming Convention: "Mono12Packed"
  std::uint32_t code = 0;    // its 32-bit value
  std::uint32_t fourcc = 0;  // V4L2's format of the same codes, unpacked
  GenicamPacking packing = GenicamPacking::none;
  int bits = 8;
  int channels = 1;  // values per pixel
};

// All that are read, those first that are taken first where several will do: more bits before
// fewer, colour before grey, unpacked before packed.
std::span<const GenicamFormat> genicam_formats();
// Null if the format is not read.
const GenicamFormat* genicam_format_of(std::uint32_t code);
const GenicamFormat* genicam_format_of(std::string_view name);

// Bytes of a picture as the camera sends it.
std::size_t genicam_picture_bytes(const GenicamFormat& format, int width, int height);

// Codes of a packed picture as little-endian words of 16 bits. `from` holds at least what `codes`
// values take; else throws std::invalid_argument, as for formats that are not packed.
void unpack_genicam(const GenicamFormat& format,
                    std::size_t codes,
                    std::span<const std::byte> from,
                    std::vector<std::byte>& to);

// Codes as a camera sends them, appended to `to`. The bits above format.bits are left out.
void pack_genicam(const GenicamFormat& format,
                  std::span<const std::uint16_t> codes,
                  std::vector<std::uint8_t>& to);

}  // namespace capture
