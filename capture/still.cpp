// Still pictures, by libav's decoders.
#include "capture/still.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <new>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "capture/coded_rows.h"
#include "capture/files.h"
#include "capture/libav.h"
#include "capture/linearise.h"
#include "capture/media_file.h"
#include "capture/picture_tags.h"
#include "capture/turn.h"

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavutil/pixdesc.h>
}

namespace capture {
namespace {

using namespace std::string_view_literals;

// Larger files are refused before they are read.
constexpr std::size_t max_file_bytes = std::size_t{1} << 30;

struct Signature {
  std::string_view begin;
  AVCodecID codec;
};
constexpr std::array signatures{
    Signature{"\x89PNG\r\n\x1a\n"sv, AV_CODEC_ID_PNG},
    Signature{"\xff\xd8\xff"sv, AV_CODEC_ID_MJPEG},
    Signature{"II*\0"sv, AV_CODEC_ID_TIFF},
    Signature{"MM\0*"sv, AV_CODEC_ID_TIFF},
    Signature{"BM"sv, AV_CODEC_ID_BMP},
    Signature{"P1\n"sv, AV_CODEC_ID_PBM},
    Signature{"P4\n"sv, AV_CODEC_ID_PBM},
    Signature{"P2\n"sv, AV_CODEC_ID_PGM},
    Signature{"P5\n"sv, AV_CODEC_ID_PGM},
    Signature{"P3\n"sv, AV_CODEC_ID_PPM},
    Signature{"P6\n"sv, AV_CODEC_ID_PPM},
    Signature{"P7\n"sv, AV_CODEC_ID_PAM},
    Signature{"\0\0\0\x0cjP  \r\n\x87\n"sv, AV_CODEC_ID_JPEG2000},
    Signature{"\xff\x4f\xff\x51"sv, AV_CODEC_ID_JPEG2000},
    Signature{"SDPX"sv, AV_CODEC_ID_DPX},
    Signature{"XPDS"sv, AV_CODEC_ID_DPX},
};
constexpr std::size_t signature_bytes = 16;

[[noreturn]] void fail(const std::string& name, const std::string& why) {
  throw std::runtime_error("cannot read " + name + ": " + why);
}

std::string ending_of(const std::string& name) {
  std::string ending = std::filesystem::path(name).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending;
}

std::optional<AVCodecID> codec_of(std::span<const std::byte> bytes, const std::string& name) {
  const std::string_view begin(reinterpret_cast<const char*>(bytes.data()),
                               std::min(bytes.size(), signature_bytes));
  for (const Signature& signature : signatures) {
    if (begin.starts_with(signature.begin)) {
      return signature.codec;
    }
  }
  if (begin.starts_with("RIFF") &&
      begin.substr(std::min<std::size_t>(8, begin.size()), 4) == "WEBP") {
    return AV_CODEC_ID_WEBP;
  }
  if (ending_of(name) == ".tga") {
    return AV_CODEC_ID_TARGA;
  }
  return std::nullopt;
}

// JPEG decoders fill what is missing with grey and say nothing.
void check_is_whole(AVCodecID codec, std::span<const std::byte> bytes, const std::string& name) {
  if (codec != AV_CODEC_ID_MJPEG) {
    return;
  }
  constexpr std::array end_of_image{std::byte{0xff}, std::byte{0xd9}};
  const auto found =
      std::find_end(bytes.begin(), bytes.end(), end_of_image.begin(), end_of_image.end());
  if (found == bytes.end()) {
    fail(name, "the file is cut short: its end marker is missing");
  }
}

libav::FrameHandle decode(AVCodecID codec,
                          std::span<const std::byte> bytes,
                          const std::string& name) {
  libav::forget_log();
  check_is_whole(codec, bytes, name);
  try {
    libav::Complaints complaints;
    const libav::CodecContext context = libav::make_decoder(codec, 1, &complaints);
    if (codec == AV_CODEC_ID_PNG || codec == AV_CODEC_ID_MJPEG) {
      // Others take a tag that they do not know for an error.
      context->err_recognition = AV_EF_CRCCHECK | AV_EF_EXPLODE;
    }
    if (const int error = avcodec_open2(context.get(), context->codec, nullptr); error < 0) {
      fail(name, libav::reason(error));
    }
    const libav::PacketHandle packet = libav::make_packet();
    if (bytes.size() > max_file_bytes ||
        av_new_packet(packet.get(), static_cast<int>(bytes.size())) < 0) {
      throw std::bad_alloc();
    }
    std::memcpy(packet->data, bytes.data(), bytes.size());
    libav::FrameHandle frame = libav::make_frame();
    int error = avcodec_send_packet(context.get(), packet.get());
    if (error >= 0) {
      avcodec_send_packet(context.get(), nullptr);
      error = avcodec_receive_frame(context.get(), frame.get());
    }
    if (error == AVERROR_EOF) {
      error = AVERROR_INVALIDDATA;
    }
    if (error < 0) {
      fail(name, libav::reason(error) + "; is the file whole?");
    }
    if (const std::string complaint = complaints.take(); !complaint.empty()) {
      fail(name, "it is damaged: " + complaint);
    }
    libav::check_size(frame->width, frame->height);
    return frame;
  } catch (const std::bad_alloc&) {
    fail(name, "not enough memory for it");
  }
}

// Of a turn that the file asks for, as the orientation in a JPEG's EXIF data does.
std::string words_on_turn(const AVFrame& frame) {
  const auto matrix = display_matrix(frame);
  const Turn turn = matrix ? turn_of_matrix(*matrix).value_or(Turn{}) : Turn{};
  return turn.any() ? ", as it lies (upright it would be " + describe(turn) + ")" : "";
}

std::vector<std::byte> first_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<std::byte> bytes(signature_bytes);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

std::vector<std::uint8_t> codes_of(const ValueGrid& grid) {
  std::vector<std::uint8_t> codes(static_cast<std::size_t>(grid.size));
  for (int index = 0; index < grid.size; ++index) {
    const double value = std::clamp(grid.value(index), 0.0, 1.0);
    codes[static_cast<std::size_t>(index)] = static_cast<std::uint8_t>(std::lround(255 * value));
  }
  return codes;
}

}  // namespace

Still8 decode_still8(std::span<const std::byte> file_bytes, const std::string& name) {
  const std::optional<AVCodecID> codec = codec_of(file_bytes, name);
  if (codec != AV_CODEC_ID_PNG && codec != AV_CODEC_ID_MJPEG) {
    fail(name, "neither PNG nor JPEG; convert it to one of them");
  }
  const libav::FrameHandle frame = decode(*codec, file_bytes, name);
  CodedRows rows(*frame);
  const bool alpha = rows.has_alpha() && *codec == AV_CODEC_ID_PNG;
  const std::vector<std::uint8_t> codes = codes_of(rows.grid());
  const std::vector<std::uint8_t> alpha_codes =
      codes_of({0, rows.max_alpha(), rows.max_alpha() + 1});

  Still8 still{frame->width, frame->height, alpha ? 4 : 3, {}};
  still.texels.resize(static_cast<std::size_t>(still.width) *
                      static_cast<std::size_t>(still.height) *
                      static_cast<std::size_t>(still.channels));
  std::uint8_t* to = still.texels.data();
  rows.begin(*frame);
  for (int y = 0; y < still.height; ++y) {
    const CodedRow row = rows.read(y);
    const std::int32_t* its_alpha = alpha ? rows.read_alpha(y) : nullptr;
    for (int x = 0; x < still.width; ++x) {
      for (const std::int32_t* channel : row) {
        *to++ = codes[static_cast<std::size_t>(channel[x])];
      }
      if (alpha) {
        *to++ = alpha_codes[static_cast<std::size_t>(its_alpha[x])];
      }
    }
  }
  return still;
}

bool is_still(const std::string& path) {
  const std::string ending = ending_of(path);
  if (ending == ".mjpeg" || ending == ".mjpg") {
    return false;
  }
  return codec_of(first_bytes(path), path).has_value();
}

Still read_still(const std::string& path, const LightCurves& curves) {
  Lineariser lineariser(curves);
  Still still;
  still.description = read_still(path, lineariser, still.image);
  return still;
}

std::string read_still(const std::string& path, Lineariser& lineariser, Image& image) {
  check_is_file(path);
  const std::vector<std::byte> bytes = read_file(path, max_file_bytes);
  const std::optional<AVCodecID> codec = codec_of(bytes, path);
  if (!codec) {
    fail(path, "not a still picture of a known kind; convert it to PNG, TIFF, JPEG or OpenEXR");
  }
  const libav::FrameHandle frame = decode(*codec, bytes, path);
  try {
    lineariser.linearise(*frame, crop_within({}, frame->width, frame->height), image);
    return std::string(avcodec_get_name(*codec)) + ", " + lineariser.description() +
           words_on_turn(*frame);
  } catch (const std::runtime_error& error) {
    fail(path, error.what());
  }
}

}  // namespace capture
