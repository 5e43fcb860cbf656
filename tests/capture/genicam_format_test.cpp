// Pixel formats of GenICam: what is packed comes out as it went in.
#include "capture/genicam_format.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "capture/counter_random.h"
#include "capture/v4l2_format.h"

namespace capture::genicam_format_test {
namespace {

using testing::ElementsAre;

TEST(GenicamFormats, NameFormatsThatAreRead) {
  for (const GenicamFormat& format : genicam_formats()) {
    EXPECT_EQ(genicam_format_of(format.name), &format);
    EXPECT_EQ(genicam_format_of(format.code), &format);
    const PixelCoding* coding = coding_of(format.fourcc);
    ASSERT_NE(coding, nullptr) << format.name;
    if (coding->kind == PixelKind::raw) {
      EXPECT_EQ(coding->raw.bits, format.bits) << format.name;
    }
    // The code's third byte tells how many bits a pixel takes.
    EXPECT_EQ(genicam_picture_bytes(format, 4, 2), (format.code >> 16U & 0xffU)) << format.name;
  }
  EXPECT_EQ(genicam_format_of("Mono13"), nullptr);
  EXPECT_EQ(genicam_format_of(0U), nullptr);
}

TEST(UnpackGenicam, UndoesPacking) {
  for (const GenicamFormat& format : genicam_formats()) {
    if (format.packing == GenicamPacking::none) continue;
    for (const std::size_t many : {8U, 13U}) {
      std::vector<std::uint16_t> codes(many);
      for (std::size_t i = 0; i < many; ++i) {
        codes[i] = static_cast<std::uint16_t>(mixed_bits(i) & ((1U << format.bits) - 1));
      }
      std::vector<std::uint8_t> packed;
      pack_genicam(format, codes, packed);
      std::vector<std::byte> words;
      unpack_genicam(format, many, std::as_bytes(std::span(packed)), words);
      ASSERT_EQ(words.size(), 2 * many);
      for (std::size_t i = 0; i < many; ++i) {
        EXPECT_EQ(std::to_integer<int>(words[2 * i]) | std::to_integer<int>(words[2 * i + 1]) << 8,
                  codes[i])
            << format.name << " " << i;
      }
      EXPECT_THROW(
          unpack_genicam(format, many, std::as_bytes(std::span(packed)).first(many), words),
          std::invalid_argument);
    }
  }
}

TEST(PackGenicam, LaysBitsOutAsTheStandardDoes) {
  const std::vector<std::uint16_t> codes{0x123, 0x2bc};
  const auto packed = [&](const char* name) {
    std::vector<std::uint8_t> bytes;
    pack_genicam(*genicam_format_of(name), codes, bytes);
    return bytes;
  };
  EXPECT_THAT(packed("Mono12"), ElementsAre(0x23, 0x01, 0xbc, 0x02));
  EXPECT_THAT(packed("Mono12Packed"), ElementsAre(0x12, 0xc3, 0x2b));
  EXPECT_THAT(packed("Mono12p"), ElementsAre(0x23, 0xc1, 0x2b));
  EXPECT_THAT(packed("Mono10Packed"), ElementsAre(0x48, 0x03, 0xaf));
  EXPECT_THAT(packed("Mono10p"), ElementsAre(0x23, 0xf1, 0x0a));
}

}  // namespace
}  // namespace capture::genicam_format_test
