// Pictures of made USB cameras.
#include "tests/guest/uvc_picture.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

extern "C" {
#include <libavcodec/avcodec.h>
}

#include "capture/colour.h"
#include "capture/libav.h"

namespace made {
namespace {

constexpr int bits = 16;

// E'Y of 0 to 1, E'CB and E'CR of -1/2 to 1/2 (BT.601).
struct Colour {
  double luma = 0;
  double blue = 0;
  double red = 0;
};

constexpr std::array<Colour, 4> patches{
    {{0.4, -0.1, 0.3}, {0.5, -0.2, -0.25}, {0.3, 0.35, -0.05}, {0.7, -0.3, 0.1}}};

double encoded(double light) { return capture::encode(capture::Transfer::rec1886, light); }
double decoded(double value) { return capture::decode(capture::Transfer::rec1886, value); }

// `at` of `whole` in steps of which there are `count`.
int step_of(int at, int whole, int count) { return at * count / whole; }

// Rows are alike within each quarter of the height.
Colour colour_at(const UvcPicture& picture, int quarter, int x, int width) {
  switch (quarter) {
    case 0: {
      const int bit = bits - 1 - step_of(x, width, bits);
      return {((picture.number >> bit) & 1) != 0 ? 1.0 : 0.0};
    }
    case 3:
      return patches[static_cast<std::size_t>(step_of(x, width, 4))];
    default:
      return {encoded(std::min(1.0, (x + 0.5) / width * picture.exposure / uvc_normal_exposure))};
  }
}

std::uint8_t code(double value, double black, double span) {
  return static_cast<std::uint8_t>(std::lround(black + span * value));
}

Bytes yuyv_row(const UvcPicture& picture, int quarter, int width) {
  Bytes bytes;
  for (int x = 0; x < width; ++x) {
    const Colour colour = colour_at(picture, quarter, x, width);
    bytes.push_back(code(colour.luma, 16, 219));
    bytes.push_back(code(x % 2 == 0 ? colour.blue : colour.red, 128, 224));
  }
  return bytes;
}

// What `value` takes of every `step`th pixel, as codes of full range.
Bytes full_row(
    const UvcPicture& picture, int quarter, int width, double Colour::*value, int step = 1) {
  Bytes bytes;
  const double black = value == &Colour::luma ? 0 : 128;
  for (int x = 0; x < width; x += step) {
    bytes.push_back(code(colour_at(picture, quarter, x, width).*value, black, 255));
  }
  return bytes;
}

// A picture of `height` rows, made of those of its quarters.
template <class Row>
Bytes stacked(int height, const Row& row) {
  Bytes all;
  for (int quarter = 0; quarter < 4; ++quarter) {
    const Bytes one = row(quarter);
    for (int y = 0; y < height / 4; ++y) all.insert(all.end(), one.begin(), one.end());
  }
  return all;
}

void check(int error, const char* call) {
  if (error < 0) throw std::runtime_error(std::string(call) + ": " + capture::libav::reason(error));
}

// An encoder of JPEGs without much loss.
capture::libav::CodecContext jpeg_encoder(int width, int height) {
  const AVCodec* const codec = avcodec_find_encoder(AV_CODEC_ID_MJPEG);
  if (codec == nullptr) throw std::runtime_error("libav has no JPEG encoder");
  capture::libav::CodecContext encoder(avcodec_alloc_context3(codec));
  encoder->width = width;
  encoder->height = height;
  encoder->pix_fmt = AV_PIX_FMT_YUVJ422P;
  encoder->time_base = {1, 30};
  encoder->thread_count = 1;
  encoder->flags |= AV_CODEC_FLAG_QSCALE;
  encoder->global_quality = FF_QP2LAMBDA;
  encoder->qmin = 1;
  check(avcodec_open2(encoder.get(), codec, nullptr), "avcodec_open2");
  return encoder;
}

// Copies rows without gaps into a plane.
void fill(AVFrame& frame, int plane, const Bytes& rows) {
  const std::size_t width = rows.size() / static_cast<std::size_t>(frame.height);
  for (int y = 0; y < frame.height; ++y) {
    std::copy_n(rows.begin() + static_cast<std::ptrdiff_t>(width) * y, width,
                frame.data[plane] + static_cast<std::ptrdiff_t>(frame.linesize[plane]) * y);
  }
}

Bytes jpeg(const UvcPicture& picture, int width, int height) {
  const auto encoder = jpeg_encoder(width, height);
  const auto frame = capture::libav::make_frame();
  frame->width = width;
  frame->height = height;
  frame->format = encoder->pix_fmt;
  frame->quality = encoder->global_quality;
  check(av_frame_get_buffer(frame.get(), 0), "av_frame_get_buffer");
  fill(*frame, 0, stacked(height, [&](int quarter) {
    return full_row(picture, quarter, width, &Colour::luma);
  }));
  fill(*frame, 1, stacked(height, [&](int quarter) {
    return full_row(picture, quarter, width, &Colour::blue, 2);
  }));
  fill(*frame, 2, stacked(height, [&](int quarter) {
    return full_row(picture, quarter, width, &Colour::red, 2);
  }));
  const auto packet = capture::libav::make_packet();
  check(avcodec_send_frame(encoder.get(), frame.get()), "avcodec_send_frame");
  check(avcodec_receive_packet(encoder.get(), packet.get()), "avcodec_receive_packet");
  return {packet->data, packet->data + packet->size};
}

}  // namespace

Bytes coded(const UvcPicture& picture, UvcFormat format, int width, int height) {
  switch (format) {
    case UvcFormat::yuyv:
      return stacked(height, [&](int quarter) { return yuyv_row(picture, quarter, width); });
    case UvcFormat::mjpeg:
      return jpeg(picture, width, height);
    case UvcFormat::grey:
      return stacked(height,
                     [&](int quarter) { return full_row(picture, quarter, width, &Colour::luma); });
  }
  throw std::invalid_argument("no such format");
}

std::uint16_t seen_number(const capture::Image& image) {
  unsigned number = 0;
  for (int bit = 0; bit < bits; ++bit) {
    const int x = (2 * bit + 1) * image.width / (2 * bits);
    number = number << 1U | (image.at(image.height / 8, x, 1) > 0.3F ? 1U : 0U);
  }
  return static_cast<std::uint16_t>(number);
}

double seen_exposure(const capture::Image& image) {
  double light = 0;
  double normal_light = 0;
  for (int x = 0; x < image.width; ++x) {
    const double here = image.at(image.height / 2, x, 1);
    if (here > 0.9) break;
    light += here;
    normal_light += (x + 0.5) / image.width;
  }
  return light / normal_light * uvc_normal_exposure;
}

std::array<std::array<double, 3>, 4> uvc_patches(bool grey) {
  std::array<std::array<double, 3>, 4> lights{};
  std::ranges::transform(patches, lights.begin(), [&](Colour colour) {
    if (grey) colour.blue = colour.red = 0;
    return std::array{decoded(colour.luma + 1.402 * colour.red),
                      decoded(colour.luma - 0.344136 * colour.blue - 0.714136 * colour.red),
                      decoded(colour.luma + 1.772 * colour.blue)};
  });
  return lights;
}

std::array<std::array<double, 3>, 4> seen_patches(const capture::Image& image) {
  std::array<std::array<double, 3>, 4> lights{};
  for (int patch = 0; patch < 4; ++patch) {
    for (int c = 0; c < 3; ++c) {
      lights[static_cast<std::size_t>(patch)][static_cast<std::size_t>(c)] =
          image.at(image.height * 7 / 8, (2 * patch + 1) * image.width / 8, c);
    }
  }
  return lights;
}

}  // namespace made
