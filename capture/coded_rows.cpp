// Decoded pictures of libav as rows of R'G'B'.
#include "capture/coded_rows.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <stdexcept>
#include <vector>

#include "capture/chroma.h"
#include "capture/libav.h"

extern "C" {
#include <libavutil/frame.h>
#include <libavutil/intreadwrite.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
}

namespace capture {
namespace {

using Samples = std::vector<std::int32_t>;

// Formats without plain samples of one depth: what swscale makes of them, of no lower depth.
std::optional<AVPixelFormat> plain_format(AVPixelFormat format, const AVPixFmtDescriptor& its) {
  switch (format) {
    case AV_PIX_FMT_XYZ12LE:
    case AV_PIX_FMT_XYZ12BE:
      return AV_PIX_FMT_RGB48LE;
    case AV_PIX_FMT_MONOWHITE:
    case AV_PIX_FMT_MONOBLACK:
      return AV_PIX_FMT_GRAY8;
    case AV_PIX_FMT_UYYVYY411:
      return AV_PIX_FMT_YUV411P;
    default:
      break;
  }
  const bool bayer = (its.flags & AV_PIX_FMT_FLAG_BAYER) != 0;
  const bool rgb = (its.flags & AV_PIX_FMT_FLAG_RGB) != 0;
  const bool wide_words = its.comp[0].depth + its.comp[0].shift > 16;
  if (bayer || wide_words) {
    // The depths of a mosaic's components are their shares of a pixel; a step is a code's bytes.
    const bool deep = bayer ? its.comp[0].step > 1 : its.comp[0].depth > 8;
    return deep ? AV_PIX_FMT_RGB48LE : AV_PIX_FMT_RGB24;
  }
  if (rgb && its.comp[0].depth < 8) {
    return AV_PIX_FMT_RGB24;
  }
  return std::nullopt;
}

// One component of one row. Words of 9 to 16 bits may hold it shifted.
void read_samples(const AVFrame& frame,
                  const AVPixFmtDescriptor& its,
                  int component,
                  int row,
                  int samples,
                  std::int32_t* to) {
  const AVComponentDescriptor& where = its.comp[component];
  const std::ptrdiff_t step = where.step;
  const std::uint8_t* from = frame.data[where.plane] +
                             static_cast<std::ptrdiff_t>(row) * frame.linesize[where.plane] +
                             where.offset;
  const int mask = (1 << where.depth) - 1;
  if (where.depth == 8 && where.shift == 0) {
    if (step == 1) {
      std::copy_n(from, samples, to);
    } else {
      for (int x = 0; x < samples; ++x) {
        to[x] = from[x * step];
      }
    }
  } else if ((its.flags & AV_PIX_FMT_FLAG_BE) != 0) {
    for (int x = 0; x < samples; ++x) {
      to[x] = (AV_RB16(from + x * step) >> where.shift) & mask;
    }
  } else if (step == 2) {
    for (int x = 0; x < samples; ++x) {
      to[x] = (AV_RL16(from + std::ptrdiff_t{2} * x) >> where.shift) & mask;
    }
  } else {
    for (int x = 0; x < samples; ++x) {
      to[x] = (AV_RL16(from + x * step) >> where.shift) & mask;
    }
  }
}

}  // namespace

// Reads one family of formats.
struct RowReader {
  RowReader(const AVFrame& frame, const AVPixFmtDescriptor& its_format)
      : its(&its_format), like(libav::make_frame()), width(frame.width) {
    for (Samples& row : rgb) {
      row.resize(static_cast<std::size_t>(width));
    }
    like->width = frame.width;
    like->height = frame.height;
    like->format = frame.format;
    like->colorspace = frame.colorspace;
    like->color_range = frame.color_range;
    like->color_trc = frame.color_trc;
    like->chroma_location = frame.chroma_location;
  }
  virtual ~RowReader() = default;
  virtual CodedRow read(int y) = 0;
  virtual const std::int32_t* read_alpha(int y) {
    alpha.resize(static_cast<std::size_t>(width));
    read_samples(*picture, *its, its->nb_components - 1, y, width, alpha.data());
    return alpha.data();
  }

  void convert_by_swscale(AVPixelFormat format) {
    scaler.reset(sws_getContext(like->width, like->height, static_cast<AVPixelFormat>(like->format),
                                like->width, like->height, format,
                                SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT, nullptr,
                                nullptr, nullptr));
    converted = libav::make_frame();
    converted->width = like->width;
    converted->height = like->height;
    converted->format = format;
    if (!scaler || av_frame_get_buffer(converted.get(), 0) < 0) {
      throw std::runtime_error(
          "its pixel format is not handled; convert it: "
          "ffmpeg -i IN -pix_fmt gbrp OUT");
    }
  }

  CodedRow all() const { return {rgb[0].data(), rgb[1].data(), rgb[2].data()}; }

  const AVPixFmtDescriptor* its;  // of the picture that is read
  libav::FrameHandle like;        // size, format and tags of all pictures
  libav::FrameHandle converted;
  libav::Scaler scaler;
  const AVFrame* picture = nullptr;
  int width;
  std::array<Samples, 3> rgb;
  Samples alpha;
};

namespace {

struct Grey : RowReader {
  using RowReader::RowReader;
  CodedRow read(int y) override {
    read_samples(*picture, *its, 0, y, width, rgb[0].data());
    return {rgb[0].data(), rgb[0].data(), rgb[0].data()};
  }
};

struct Rgb : RowReader {
  using RowReader::RowReader;
  CodedRow read(int y) override {
    for (int c = 0; c < 3; ++c) {
      read_samples(*picture, *its, c, y, width, rgb[static_cast<std::size_t>(c)].data());
    }
    return all();
  }
};

struct Palette : RowReader {
  using RowReader::RowReader;
  CodedRow read(int y) override {
    const std::uint8_t* codes =
        picture->data[0] + static_cast<std::ptrdiff_t>(y) * picture->linesize[0];
    const auto* palette = reinterpret_cast<const std::uint32_t*>(picture->data[1]);
    for (int x = 0; x < width; ++x) {
      const std::uint32_t argb = palette[codes[x]];
      for (std::size_t c = 0; c < 3; ++c) {
        rgb[c][static_cast<std::size_t>(x)] = static_cast<int>(argb >> (16 - 8 * c)) & 0xff;
      }
    }
    return all();
  }
  const std::int32_t* read_alpha(int y) override {
    const std::uint8_t* codes =
        picture->data[0] + static_cast<std::ptrdiff_t>(y) * picture->linesize[0];
    const auto* palette = reinterpret_cast<const std::uint32_t*>(picture->data[1]);
    alpha.resize(static_cast<std::size_t>(width));
    for (int x = 0; x < width; ++x) {
      alpha[static_cast<std::size_t>(x)] = static_cast<int>(palette[codes[x]] >> 24);
    }
    return alpha.data();
  }
};

struct Ycbcr : RowReader {
  Ycbcr(const AVFrame& frame, const AVPixFmtDescriptor& its_format, const YcbcrTags& tags)
      : RowReader(frame, its_format),
        across(1 << its_format.log2_chroma_w, tags.across),
        down(1 << its_format.log2_chroma_h, tags.down),
        matrix({tags.kr, tags.kb, tags.full_range, its_format.comp[0].depth,
                across.units() * down.units()}),
        chroma_width(AV_CEIL_RSHIFT(frame.width, its_format.log2_chroma_w)),
        chroma_height(AV_CEIL_RSHIFT(frame.height, its_format.log2_chroma_h)) {
    luma.resize(static_cast<std::size_t>(width));
    upper.resize(static_cast<std::size_t>(chroma_width) + 2);
    lower.resize(upper.size());
    for (Samples& row : chroma) {
      row.resize(static_cast<std::size_t>(chroma_width * across.factor()));
    }
  }

  CodedRow read(int y) override {
    read_samples(*picture, *its, 0, y, width, luma.data());
    read_chroma(1, y);
    read_chroma(2, y);
    matrix.convert(width, luma.data(), chroma[0].data(), chroma[1].data(), rgb[0].data(),
                   rgb[1].data(), rgb[2].data());
    return all();
  }

  void read_chroma(int component, int y) {
    const int phase = y % down.factor();
    const int first = y / down.factor() + down.before(phase);
    const int weight = down.weight(phase);
    const auto row_at = [&](int row) { return std::clamp(row, 0, chroma_height - 1); };
    read_samples(*picture, *its, component, row_at(first), chroma_width, upper.data() + 1);
    if (down.units() > 1) {
      read_samples(*picture, *its, component, row_at(first + 1), chroma_width, lower.data() + 1);
      blend_chroma(chroma_width, upper.data() + 1, down.units() - weight, lower.data() + 1, weight);
    }
    upper.front() = upper[1];
    upper.back() = upper[static_cast<std::size_t>(chroma_width)];
    Samples& wide = chroma[static_cast<std::size_t>(component - 1)];
    widen_chroma(across, chroma_width, upper.data(), wide.data());
  }

  ChromaSteps across;
  ChromaSteps down;
  YcbcrMatrix matrix;
  int chroma_width;
  int chroma_height;
  Samples luma, upper, lower;  // chroma rows padded by one on either side
  std::array<Samples, 2> chroma;
};

// The grid of codes that are values already.
ValueGrid code_grid(int depth, bool limited) {
  const int codes = 1 << depth;
  return limited ? ValueGrid{16 << (depth - 8), 235 << (depth - 8), codes}
                 : ValueGrid{0, codes - 1, codes};
}

}  // namespace

CodedRows::CodedRows(const AVFrame& frame) : transfer_tag_(capture::transfer_tag(frame)) {
  auto format = static_cast<AVPixelFormat>(frame.format);
  const AVPixFmtDescriptor* its = av_pix_fmt_desc_get(format);
  if (its == nullptr) {
    throw std::runtime_error("its pixel format is not known");
  }
  description_ = its->name;
  if ((its->flags & (AV_PIX_FMT_FLAG_FLOAT | AV_PIX_FMT_FLAG_HWACCEL)) != 0) {
    throw std::runtime_error("its pixel format, " + description_ +
                             ", is not handled; for float pictures use OpenEXR or Radiance files");
  }
  const std::optional<AVPixelFormat> plain = plain_format(format, *its);
  if (plain) {
    format = *plain;
    its = av_pix_fmt_desc_get(format);
    description_ += std::string(" by swscale as ") + its->name;
  }
  if ((its->flags & (AV_PIX_FMT_FLAG_RGB | AV_PIX_FMT_FLAG_PAL)) == 0 && its->nb_components >= 3) {
    const YcbcrTags tags = ycbcr_tags(frame);
    auto reader = std::make_unique<Ycbcr>(frame, *its, tags);
    grid_ = reader->matrix.grid();
    description_ += ", " + tags.description;
    reader_ = std::move(reader);
  } else {
    const bool limited = is_limited_rgb(frame);
    grid_ = code_grid(its->comp[0].depth, limited);
    description_ += limited ? ", limited" : ", full";
    if ((its->flags & AV_PIX_FMT_FLAG_PAL) != 0) {
      reader_ = std::make_unique<Palette>(frame, *its);
    } else if ((its->flags & AV_PIX_FMT_FLAG_RGB) != 0) {
      reader_ = std::make_unique<Rgb>(frame, *its);
    } else {
      reader_ = std::make_unique<Grey>(frame, *its);
    }
  }
  if (plain) {
    reader_->convert_by_swscale(*plain);
  }
}

CodedRows::~CodedRows() = default;

bool CodedRows::fits(const AVFrame& frame) const { return are_alike(frame, *reader_->like); }

void CodedRows::begin(const AVFrame& frame) {
  if (!fits(frame)) {
    throw std::invalid_argument("a picture of another kind");
  }
  reader_->picture = &frame;
  if (reader_->scaler) {
    sws_scale(reader_->scaler.get(), frame.data, frame.linesize, 0, frame.height,
              reader_->converted->data, reader_->converted->linesize);
    reader_->picture = reader_->converted.get();
  }
}

CodedRow CodedRows::read(int y) { return reader_->read(y); }

const std::uint8_t* CodedRows::packed_rgb(int y) const {
  const AVFrame& picture = *reader_->picture;
  if (picture.format != AV_PIX_FMT_RGB24) return nullptr;
  return picture.data[0] + static_cast<std::ptrdiff_t>(y) * picture.linesize[0];
}

bool CodedRows::has_alpha() const { return (reader_->its->flags & AV_PIX_FMT_FLAG_ALPHA) != 0; }

int CodedRows::max_alpha() const {
  return (1 << reader_->its->comp[reader_->its->nb_components - 1].depth) - 1;
}

const std::int32_t* CodedRows::read_alpha(int y) { return reader_->read_alpha(y); }

}  // namespace capture
