// What a made GigE Vision camera tells of its features: GenICam XML, and where its registers are.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "capture/camera.h"
#include "capture/genicam_format.h"

namespace capture::gige {

// Registers of the made camera's features: 4 bytes, or 8 for numbers with a fraction.
namespace feature {
constexpr std::uint32_t sensor_width = 0xe000;
constexpr std::uint32_t sensor_height = 0xe004;
constexpr std::uint32_t width = 0xe008;
constexpr std::uint32_t height = 0xe00c;
constexpr std::uint32_t offset_x = 0xe010;
constexpr std::uint32_t offset_y = 0xe014;
constexpr std::uint32_t pixel_format = 0xe018;
constexpr std::uint32_t payload_size = 0xe01c;
constexpr std::uint32_t acquisition = 0xe020;  // 1 = running
constexpr std::uint32_t acquisition_mode = 0xe024;
constexpr std::uint32_t chunk_mode = 0xe028;
constexpr std::uint32_t chunk_selector = 0xe02c;
constexpr std::uint32_t chunk_enable = 0xe030;  // one for each of made_chunks
constexpr std::uint32_t device_link_mode = 0xe040;
constexpr std::uint32_t exposure_us = 0xe048;
constexpr std::uint32_t frame_rate = 0xe050;
constexpr std::uint32_t gain_db = 0xe058;
}  // namespace feature

// The description lies behind all registers.
constexpr std::uint32_t register_bytes = 0x10000;
constexpr std::uint32_t description_at = register_bytes;

enum MadeChunk : std::uint32_t { exposure_chunk = 0, timestamp_chunk = 1, frame_id_chunk = 2 };
constexpr std::uint32_t made_chunks = 3;
constexpr std::uint32_t chunk_id(std::uint32_t chunk) { return 0x1000 + chunk; }
constexpr std::uint32_t image_chunk_id = 0x0001;
constexpr double most_gain_db = 24;

struct MadeDescription {
  std::vector<GenicamFormat> formats;
  ExposureRange exposures;
  double lowest_rate = 1;
  double highest_rate = 60;
  std::uint32_t largest_packet = 9000;
  bool has_chunks = false;
};

// GenICam, "GenApi Schema" 1.1, with the features' names of the Standard Features Naming
// Convention.
std::string describe_made(const MadeDescription& camera);

}  // namespace capture::gige
