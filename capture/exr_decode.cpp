// platelight-decode: decodes the OpenEXR file on standard input, confined, and writes its picture
// to standard output (exr_wire.h). A damaged file may crash it; that is what it is for.
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <exception>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfRgbaFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTestFile.h>
#include <OpenEXR/ImfVecAttribute.h>

#include "capture/exr.h"
#include "capture/exr_wire.h"
#include "capture/helper_io.h"
#include "capture/sandbox.h"

namespace {

namespace wire = capture::wire;
using Imath::Box2i;

// Standard input, read where it is asked: a file need not fit in memory.
class StandardInput : public Imf::IStream {
 public:
  StandardInput() : Imf::IStream("the file") {}
  bool read(char bytes[], int count) override {
    std::size_t left = static_cast<std::size_t>(std::max(count, 0));
    while (left > 0) {
      const ssize_t got = pread(STDIN_FILENO, bytes, left, static_cast<off_t>(position_));
      if (got < 0 && errno == EINTR) continue;
      if (got < 0) throw std::system_error(errno, std::generic_category(), "cannot read it");
      if (got == 0) throw std::runtime_error("it ends too early");
      bytes += got;
      position_ += static_cast<std::uint64_t>(got);
      left -= static_cast<std::size_t>(got);
    }
    return true;
  }
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override { position_ = position; }

 private:
  std::uint64_t position_ = 0;
};

constexpr auto tell = capture::send_message<wire::Prefix>;

// Both windows of a picture, in 64 bits, since hostile ones overflow.
struct Window {
  std::int64_t left = 0;
  std::int64_t top = 0;
  std::int64_t width = 0;
  std::int64_t height = 0;

  explicit Window(const Box2i& box)
      : left(box.min.x),
        top(box.min.y),
        width(std::int64_t{box.max.x} - box.min.x + 1),
        height(std::int64_t{box.max.y} - box.min.y + 1) {}
};

void require_size(const Window& window, const char* name) {
  if (window.width < 1 || window.height < 1 || window.width > wire::max_side ||
      window.height > wire::max_side) {
    throw std::runtime_error(std::string("its ") + name + " window is " +
                             std::to_string(window.width) + " x " + std::to_string(window.height) +
                             " pixels; 1 to " + std::to_string(wire::max_side) +
                             " a side can be read");
  }
}

enum class Layout { grey, rgb, rgba, luminance_chroma };

// Which of the root channels make the picture.
Layout layout_of(const Imf::ChannelList& channels) {
  const auto has = [&](const char* name) { return channels.findChannel(name) != nullptr; };
  if (has("R") && has("G") && has("B")) return has("A") ? Layout::rgba : Layout::rgb;
  if (has("Y") && has("RY") && has("BY")) return Layout::luminance_chroma;
  if (has("Y")) return Layout::grey;
  std::string found;
  int listed = 0;
  constexpr int enough = 12;
  for (auto i = channels.begin(); i != channels.end() && listed < enough; ++i, ++listed) {
    found += found.empty() ? i.name() : std::string(", ") + i.name();
  }
  throw std::runtime_error("it has no channels R, G, B or Y, only: " + found);
}

std::vector<const char*> names_of(Layout layout) {
  switch (layout) {
    case Layout::grey:
      return {"Y"};
    case Layout::rgb:
    case Layout::luminance_chroma:
      return {"R", "G", "B"};
    case Layout::rgba:
      return {"R", "G", "B", "A"};
  }
  throw std::logic_error("a layout without names");
}

// Where the data window and the picture (the display window) meet.
struct Overlap {
  std::int64_t left = 0;
  std::int64_t right = 0;  // one past
  std::int64_t top = 0;
  std::int64_t bottom = 0;  // one past

  Overlap(const Window& data, const Window& display)
      : left(std::max(data.left, display.left)),
        right(std::min(data.left + data.width, display.left + display.width)),
        top(std::max(data.top, display.top)),
        bottom(std::min(data.top + data.height, display.top + display.height)) {
    if (left >= right || top >= bottom) {
      throw std::runtime_error("its data window lies wholly outside its display window");
    }
  }
};

// Sends the picture strip by strip; `fill(first, last, strip)` decodes rows of the data window into
// interleaved floats. What the data window does not cover is 0.
template <class Fill>
void send_rows(const Window& data, const Window& display, std::size_t channels, Fill fill) {
  const Overlap overlap(data, display);
  const auto data_row = static_cast<std::size_t>(data.width) * channels;
  const auto picture_row = static_cast<std::size_t>(display.width) * channels;
  constexpr std::size_t strip_floats = std::size_t{1} << 20;
  const auto strip_rows = static_cast<std::int64_t>(
      std::max<std::size_t>(1, strip_floats / std::max(data_row, picture_row)));
  const auto skipped = static_cast<std::size_t>(overlap.left - data.left) * channels;
  const auto margin = static_cast<std::size_t>(overlap.left - display.left) * channels;
  const auto copied = static_cast<std::size_t>(overlap.right - overlap.left) * channels;

  std::vector<float> strip;
  std::vector<float> picture;
  for (std::int64_t top = display.top; top < display.top + display.height; top += strip_rows) {
    const std::int64_t bottom = std::min(top + strip_rows, display.top + display.height);
    picture.assign(static_cast<std::size_t>(bottom - top) * picture_row, 0.0F);
    const std::int64_t first = std::max(top, overlap.top);
    const std::int64_t last = std::min(bottom, overlap.bottom);
    if (first < last) {
      strip.resize(static_cast<std::size_t>(last - first) * data_row);
      fill(static_cast<int>(first), static_cast<int>(last - 1), strip);
      for (std::int64_t y = first; y < last; ++y) {
        const float* from = &strip[static_cast<std::size_t>(y - first) * data_row + skipped];
        std::copy_n(from, copied,
                    &picture[static_cast<std::size_t>(y - top) * picture_row + margin]);
      }
    }
    tell(wire::Kind::rows, std::as_bytes(std::span(picture)));
  }
  tell(wire::Kind::end, {});
}

// The text of a lens, if there is any to be sent, and what there is.
wire::LensNote find_lens(const Imf::Header& header, std::string& text) {
  if (header.find(wire::lens_attribute) == header.end()) return wire::LensNote::none;
  const auto* told = header.findTypedAttribute<Imf::StringAttribute>(wire::lens_attribute);
  if (told == nullptr) return wire::LensNote::no_text;
  if (told->value().size() > capture::most_lens_text) return wire::LensNote::too_long;
  text = told->value();
  return text.empty() ? wire::LensNote::none : wire::LensNote::text;
}

void send_header(const Imf::Header& header, const Window& display, std::size_t channels) {
  wire::Header out{static_cast<std::int32_t>(display.width),
                   static_cast<std::int32_t>(display.height),
                   static_cast<std::int32_t>(channels),
                   0,
                   {},
                   0,
                   {},
                   header.pixelAspectRatio()};
  if (Imf::hasChromaticities(header)) {
    const Imf::Chromaticities& c = Imf::chromaticities(header);
    out.has_primaries = 1;
    out.primaries = {c.red.x,  c.red.y,  c.green.x, c.green.y,
                     c.blue.x, c.blue.y, c.white.x, c.white.y};
  }
  if (const auto* noise = header.findTypedAttribute<Imf::V2fAttribute>(wire::noise_attribute)) {
    out.has_noise = 1;
    out.noise = {noise->value().x, noise->value().y};
  }
  if (const auto* told =
          header.findTypedAttribute<Imf::StringAttribute>(wire::transfer_attribute)) {
    std::copy_n(told->value().begin(), std::min(told->value().size(), out.transfer.size()),
                out.transfer.begin());
  }
  std::string lens;
  out.lens = find_lens(header, lens);
  tell(wire::Kind::header, std::as_bytes(std::span(&out, 1)));
  if (!lens.empty()) tell(wire::Kind::lens, std::as_bytes(std::span(lens)));
}

void send_plain(StandardInput& input) {
  Imf::InputFile file(input, 0);
  const Imf::Header& header = file.header();
  const Window data(header.dataWindow());
  const Window display(header.displayWindow());
  const std::vector<const char*> names = names_of(layout_of(header.channels()));
  for (const char* name : names) {
    const Imf::Channel& channel = header.channels()[name];
    if (channel.xSampling != 1 || channel.ySampling != 1) {
      throw std::runtime_error(std::string("its channel ") + name +
                               " is subsampled, which is read only for luminance with chroma");
    }
  }
  send_header(header, display, names.size());
  const std::size_t pixel_bytes = names.size() * sizeof(float);
  send_rows(data, display, names.size(), [&](int first, int last, std::vector<float>& strip) {
    Imf::FrameBuffer buffer;
    for (std::size_t c = 0; c < names.size(); ++c) {
      buffer.insert(names[c], Imf::Slice::Make(Imf::FLOAT, &strip[c],
                                               Imath::V2i(static_cast<int>(data.left), first),
                                               data.width, last - first + 1, pixel_bytes,
                                               pixel_bytes * static_cast<std::size_t>(data.width)));
    }
    file.setFrameBuffer(buffer);
    file.readPixels(first, last);
  });
}

// Subsampled luminance and chroma go through the library's own reconstruction, in half floats.
void send_luminance_chroma(StandardInput& input) {
  Imf::RgbaInputFile file(input, 0);
  const Window data(file.dataWindow());
  const Window display(file.displayWindow());
  constexpr std::size_t channels = 3;
  send_header(file.header(), display, channels);
  std::vector<Imf::Rgba> rgba;
  send_rows(data, display, channels, [&](int first, int last, std::vector<float>& strip) {
    rgba.resize(strip.size() / channels);
    const std::ptrdiff_t origin = data.left + first * data.width;
    file.setFrameBuffer(rgba.data() - origin, 1, static_cast<std::size_t>(data.width));
    file.readPixels(first, last);
    for (std::size_t i = 0; i < rgba.size(); ++i) {
      strip[channels * i] = rgba[i].r;
      strip[channels * i + 1] = rgba[i].g;
      strip[channels * i + 2] = rgba[i].b;
    }
  });
}

void decode() {
  StandardInput input;
  bool tiled = false;
  bool deep = false;
  bool multi_part = false;
  if (!Imf::isOpenExrFile(input, tiled, deep, multi_part)) {
    throw std::runtime_error("it is no OpenEXR file");
  }
  if (deep) throw std::runtime_error("it holds deep data, which are not read");
  input.seekg(0);
  Imf::Header::setMaxImageSize(wire::max_side, wire::max_side);
  Imf::Header::setMaxTileSize(wire::max_side, wire::max_side);
  Layout layout{};
  {
    const Imf::InputFile file(input, 0);
    require_size(Window(file.header().dataWindow()), "data");
    require_size(Window(file.header().displayWindow()), "display");
    layout = layout_of(file.header().channels());
  }
  input.seekg(0);
  if (layout == Layout::luminance_chroma) {
    send_luminance_chroma(input);
  } else {
    send_plain(input);
  }
}

}  // namespace

int main() {
  try {
    capture::confine_this_process({});
    decode();
    return 0;
  } catch (const std::exception& error) {
    try {
      tell(wire::Kind::failure, std::as_bytes(std::span(std::string_view(error.what()))));
    } catch (const std::exception&) {
      return 2;  // nobody listens
    }
    return 1;
  }
}
