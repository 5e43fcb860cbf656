// Pixel formats of GenICam.
#include "capture/genicam_format.h"

#include <algorithm>
#include <array>
#include <stdexcept>

#include <linux/videodev2.h>

namespace capture {
namespace {

using enum GenicamPacking;

constexpr std::array formats{
    GenicamFormat{"BayerRG16", 0x0110002f, V4L2_PIX_FMT_SRGGB16, none, 16, 1},
    GenicamFormat{"BayerGR16", 0x0110002e, V4L2_PIX_FMT_SGRBG16, none, 16, 1},
    GenicamFormat{"BayerGB16", 0x01100030, V4L2_PIX_FMT_SGBRG16, none, 16, 1},
    GenicamFormat{"BayerBG16", 0x01100031, V4L2_PIX_FMT_SBGGR16, none, 16, 1},
    GenicamFormat{"BayerRG12", 0x01100011, V4L2_PIX_FMT_SRGGB12, none, 12, 1},
    GenicamFormat{"BayerGR12", 0x01100010, V4L2_PIX_FMT_SGRBG12, none, 12, 1},
    GenicamFormat{"BayerGB12", 0x01100012, V4L2_PIX_FMT_SGBRG12, none, 12, 1},
    GenicamFormat{"BayerBG12", 0x01100013, V4L2_PIX_FMT_SBGGR12, none, 12, 1},
    GenicamFormat{"BayerRG12Packed", 0x010c002b, V4L2_PIX_FMT_SRGGB12, gige12, 12, 1},
    GenicamFormat{"BayerGR12Packed", 0x010c002a, V4L2_PIX_FMT_SGRBG12, gige12, 12, 1},
    GenicamFormat{"BayerGB12Packed", 0x010c002c, V4L2_PIX_FMT_SGBRG12, gige12, 12, 1},
    GenicamFormat{"BayerBG12Packed", 0x010c002d, V4L2_PIX_FMT_SBGGR12, gige12, 12, 1},
    GenicamFormat{"BayerRG12p", 0x010c0059, V4L2_PIX_FMT_SRGGB12, lsb12, 12, 1},
    GenicamFormat{"BayerGR12p", 0x010c0057, V4L2_PIX_FMT_SGRBG12, lsb12, 12, 1},
    GenicamFormat{"BayerGB12p", 0x010c0055, V4L2_PIX_FMT_SGBRG12, lsb12, 12, 1},
    GenicamFormat{"BayerBG12p", 0x010c0053, V4L2_PIX_FMT_SBGGR12, lsb12, 12, 1},
    GenicamFormat{"BayerRG10", 0x0110000d, V4L2_PIX_FMT_SRGGB10, none, 10, 1},
    GenicamFormat{"BayerGR10", 0x0110000c, V4L2_PIX_FMT_SGRBG10, none, 10, 1},
    GenicamFormat{"BayerGB10", 0x0110000e, V4L2_PIX_FMT_SGBRG10, none, 10, 1},
    GenicamFormat{"BayerBG10", 0x0110000f, V4L2_PIX_FMT_SBGGR10, none, 10, 1},
    GenicamFormat{"BayerRG10Packed", 0x010c0027, V4L2_PIX_FMT_SRGGB10, gige10, 10, 1},
    GenicamFormat{"BayerGR10Packed", 0x010c0026, V4L2_PIX_FMT_SGRBG10, gige10, 10, 1},
    GenicamFormat{"BayerGB10Packed", 0x010c0028, V4L2_PIX_FMT_SGBRG10, gige10, 10, 1},
    GenicamFormat{"BayerBG10Packed", 0x010c0029, V4L2_PIX_FMT_SBGGR10, gige10, 10, 1},
    GenicamFormat{"BayerRG10p", 0x010a0058, V4L2_PIX_FMT_SRGGB10, lsb10, 10, 1},
    GenicamFormat{"BayerGR10p", 0x010a0056, V4L2_PIX_FMT_SGRBG10, lsb10, 10, 1},
    GenicamFormat{"BayerGB10p", 0x010a0054, V4L2_PIX_FMT_SGBRG10, lsb10, 10, 1},
    GenicamFormat{"BayerBG10p", 0x010a0052, V4L2_PIX_FMT_SBGGR10, lsb10, 10, 1},
    GenicamFormat{"RGB8", 0x02180014, V4L2_PIX_FMT_RGB24, none, 8, 3},
    GenicamFormat{"BGR8", 0x02180015, V4L2_PIX_FMT_BGR24, none, 8, 3},
    GenicamFormat{"BayerRG8", 0x01080009, V4L2_PIX_FMT_SRGGB8, none, 8, 1},
    GenicamFormat{"BayerGR8", 0x01080008, V4L2_PIX_FMT_SGRBG8, none, 8, 1},
    GenicamFormat{"BayerGB8", 0x0108000a, V4L2_PIX_FMT_SGBRG8, none, 8, 1},
    GenicamFormat{"BayerBG8", 0x0108000b, V4L2_PIX_FMT_SBGGR8, none, 8, 1},
    GenicamFormat{"Mono16", 0x01100007, V4L2_PIX_FMT_Y16, none, 16, 1},
    GenicamFormat{"Mono14", 0x01100025, V4L2_PIX_FMT_Y14, none, 14, 1},
    GenicamFormat{"Mono12", 0x01100005, V4L2_PIX_FMT_Y12, none, 12, 1},
    GenicamFormat{"Mono12Packed", 0x010c0006, V4L2_PIX_FMT_Y12, gige12, 12, 1},
    GenicamFormat{"Mono12p", 0x010c0047, V4L2_PIX_FMT_Y12, lsb12, 12, 1},
    GenicamFormat{"Mono10", 0x01100003, V4L2_PIX_FMT_Y10, none, 10, 1},
    GenicamFormat{"Mono10Packed", 0x010c0004, V4L2_PIX_FMT_Y10, gige10, 10, 1},
    GenicamFormat{"Mono10p", 0x010a0046, V4L2_PIX_FMT_Y10, lsb10, 10, 1},
    GenicamFormat{"Mono8", 0x01080001, V4L2_PIX_FMT_GREY, none, 8, 1},
};

std::size_t bytes_of(const GenicamFormat& format, std::size_t codes) {
  switch (format.packing) {
    case none:
      return codes * (format.bits > 8 ? 2 : 1);
    case lsb10:
      return (codes * 10 + 7) / 8;
    default:
      return (codes * 12 + 7) / 8;
  }
}

// Where a code lies in its packing: the bits of its low part, and how far its high part is shifted.
std::uint32_t code_at(const GenicamFormat& format, const std::uint8_t* bytes, std::size_t i) {
  switch (format.packing) {
    case gige10:
    case gige12: {
      const std::uint8_t* const pair = bytes + i / 2 * 3;
      const auto low_bits = static_cast<unsigned>(format.bits - 8);
      const std::uint32_t mask = (1U << low_bits) - 1;
      return i % 2 == 0 ? static_cast<std::uint32_t>(pair[0]) << low_bits | (pair[1] & mask)
                        : static_cast<std::uint32_t>(pair[2]) << low_bits | (pair[1] >> 4U & mask);
    }
    default: {
      const auto bits = static_cast<std::size_t>(format.bits);
      const std::uint8_t* const at = bytes + i * bits / 8;
      const std::uint32_t two = at[0] | static_cast<std::uint32_t>(at[1]) << 8U;
      return two >> (i * bits % 8) & ((1U << bits) - 1);
    }
  }
}

void put_code(const GenicamFormat& format, std::uint8_t* bytes, std::size_t i, std::uint32_t code) {
  const auto add = [](std::uint8_t& to, std::uint32_t value) {
    to = static_cast<std::uint8_t>(to | (value & 0xffU));
  };
  if (format.packing == gige10 || format.packing == gige12) {
    std::uint8_t* const pair = bytes + i / 2 * 3;
    const auto low_bits = static_cast<unsigned>(format.bits - 8);
    const std::uint32_t low = code & ((1U << low_bits) - 1);
    add(pair[i % 2 == 0 ? 0 : 2], code >> low_bits);
    add(pair[1], i % 2 == 0 ? low : low << 4U);
    return;
  }
  const auto bits = static_cast<std::size_t>(format.bits);
  std::uint8_t* const at = bytes + i * bits / 8;
  const std::uint32_t shifted = code << (i * bits % 8);
  add(at[0], shifted);
  add(at[1], shifted >> 8U);
}

}  // namespace

std::span<const GenicamFormat> genicam_formats() { return formats; }

const GenicamFormat* genicam_format_of(std::uint32_t code) {
  const auto found = std::ranges::find(formats, code, &GenicamFormat::code);
  return found == formats.end() ? nullptr : &*found;
}

const GenicamFormat* genicam_format_of(std::string_view name) {
  const auto found = std::ranges::find(formats, name, &GenicamFormat::name);
  return found == formats.end() ? nullptr : &*found;
}

std::size_t genicam_picture_bytes(const GenicamFormat& format, int width, int height) {
  return bytes_of(format, static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                              static_cast<std::size_t>(format.channels));
}

void unpack_genicam(const GenicamFormat& format,
                    std::size_t codes,
                    std::span<const std::byte> from,
                    std::vector<std::byte>& to) {
  if (format.packing == none || from.size() < bytes_of(format, codes)) {
    throw std::invalid_argument("there are not as many packed codes");
  }
  to.resize(2 * codes);
  const auto* const bytes = reinterpret_cast<const std::uint8_t*>(from.data());
  for (std::size_t i = 0; i < codes; ++i) {
    const std::uint32_t code = code_at(format, bytes, i);
    to[2 * i] = static_cast<std::byte>(code & 0xffU);
    to[2 * i + 1] = static_cast<std::byte>(code >> 8U);
  }
}

void pack_genicam(const GenicamFormat& format,
                  std::span<const std::uint16_t> codes,
                  std::vector<std::uint8_t>& to) {
  const std::size_t from = to.size();
  to.resize(from + bytes_of(format, codes.size()));
  std::uint8_t* const bytes = to.data() + from;
  const std::uint32_t mask = (1U << static_cast<unsigned>(format.bits)) - 1;
  for (std::size_t i = 0; i < codes.size(); ++i) {
    const std::uint32_t code = codes[i] & mask;
    if (format.packing != none) {
      put_code(format, bytes, i, code);
    } else if (format.bits > 8) {
      bytes[2 * i] = static_cast<std::uint8_t>(code & 0xffU);
      bytes[2 * i + 1] = static_cast<std::uint8_t>(code >> 8U);
    } else {
      bytes[i] = static_cast<std::uint8_t>(code);
    }
  }
}

}  // namespace capture
