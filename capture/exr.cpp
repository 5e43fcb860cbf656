// OpenEXR: writing through the library, reading through a confined child.
#include "capture/exr.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <set>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTimeCode.h>
#include <OpenEXR/ImfVecAttribute.h>

#include "capture/exr_wire.h"
#include "capture/primaries.h"
#include "capture/sandbox.h"

namespace capture {
namespace {

std::string reason(int error) { return std::generic_category().message(error); }

// Bytes to a file, remembering the first failure: the library writes its table of offsets in a
// destructor, where an exception would be lost.
class FileOutput : public Imf::OStream {
 public:
  explicit FileOutput(const std::string& path) : Imf::OStream(path.c_str()) {
    fd_ = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (fd_ < 0) throw std::runtime_error(path + ": cannot be written: " + reason(errno));
  }
  ~FileOutput() override {
    if (fd_ >= 0) close(fd_);
  }
  FileOutput(const FileOutput&) = delete;
  FileOutput& operator=(const FileOutput&) = delete;

  void write(const char bytes[], int count) override {
    std::size_t left = static_cast<std::size_t>(std::max(count, 0));
    while (left > 0 && error_ == 0) {
      const ssize_t done = pwrite(fd_, bytes, left, static_cast<off_t>(position_));
      if (done < 0 && errno == EINTR) continue;
      if (done < 0) {
        error_ = errno;
        break;
      }
      bytes += done;
      position_ += static_cast<std::uint64_t>(done);
      left -= static_cast<std::size_t>(done);
    }
    require_success();
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }

  // After the library is done: everything is with the system.
  void finish() {
    require_success();
    const int closed = close(fd_);
    fd_ = -1;
    if (closed != 0) error_ = errno;
    require_success();
  }

 private:
  void require_success() const {
    if (error_ != 0) throw std::runtime_error("cannot be written: " + reason(error_));
  }

  int fd_ = -1;
  int error_ = 0;
  std::uint64_t position_ = 0;
};

Imf::Compression library_compression(ExrCompression compression) {
  switch (compression) {
    case ExrCompression::none:
      return Imf::NO_COMPRESSION;
    case ExrCompression::rle:
      return Imf::RLE_COMPRESSION;
    case ExrCompression::zip:
      return Imf::ZIP_COMPRESSION;
    case ExrCompression::piz:
      return Imf::PIZ_COMPRESSION;
  }
  throw std::invalid_argument("no such EXR compression");
}

bool is_lens_text(std::string_view text) {
  return text.size() <= most_lens_text && std::ranges::all_of(text, [](char c) {
           return (c >= ' ' && c <= '~') || c == '\t' || c == '\n';
         });
}

Imf::Header make_header(int width, int height, const ExrOptions& options) {
  Imf::Header header(width, height);
  header.pixelAspectRatio() = static_cast<float>(options.pixel_aspect.value());
  header.compression() = library_compression(options.compression);
  Imf::addChromaticities(header, Imf::Chromaticities());  // the library's defaults are Rec.709's
  if (options.timecode) {
    const ExrTimecode& t = *options.timecode;
    if (t.hours < 0 || t.hours > 23 || t.minutes < 0 || t.minutes > 59 || t.seconds < 0 ||
        t.seconds > 59 || t.frames < 0 || t.frames > 39) {
      throw std::invalid_argument("a time code in an EXR file ends at 23:59:59:39");
    }
    Imf::addTimeCode(header, Imf::TimeCode(t.hours, t.minutes, t.seconds, t.frames, t.drop_frame,
                                           false, t.second_of_pair));
  }
  if (options.frames_per_second) {
    const Rational& rate = *options.frames_per_second;
    if (rate.num < 1 || rate.den < 1 || rate.num > INT32_MAX || rate.den > INT32_MAX) {
      throw std::invalid_argument("a frame rate is a ratio of two positive 32-bit numbers");
    }
    Imf::addFramesPerSecond(
        header, Imf::Rational(static_cast<int>(rate.num), static_cast<unsigned>(rate.den)));
  }
  if (options.noise) {
    header.insert(wire::noise_attribute,
                  Imf::V2fAttribute(Imath::V2f(options.noise->gain, options.noise->floor)));
  }
  if (!options.transfer.empty()) {
    header.insert(wire::transfer_attribute, Imf::StringAttribute(options.transfer));
  }
  if (!options.lens.empty()) {
    if (!is_lens_text(options.lens)) {
      throw std::invalid_argument("the text of a lens in an EXR file is of at most " +
                                  std::to_string(most_lens_text) + " printable characters");
    }
    header.insert(wire::lens_attribute, Imf::StringAttribute(options.lens));
  }
  return header;
}

// One channel as the library wants it.
struct Slice {
  std::string name;
  const void* first;  // of pixel (0, 0)
  std::size_t pixel_stride;
  std::size_t row_stride;
};

void write_slices(const std::string& path,
                  const Imf::Header& bare_header,
                  Imf::PixelType type,
                  std::span<const Slice> slices) {
  Imf::Header header = bare_header;
  Imf::FrameBuffer buffer;
  for (const Slice& slice : slices) {
    header.channels().insert(slice.name, Imf::Channel(type));
    // The library takes char* for reading and writing alike; here it only reads.
    buffer.insert(slice.name,
                  Imf::Slice(type, const_cast<char*>(static_cast<const char*>(slice.first)),
                             slice.pixel_stride, slice.row_stride));
  }
  const std::string partial = path + ".part";
  try {
    FileOutput output(partial);
    {
      Imf::OutputFile file(output, header, 0);
      file.setFrameBuffer(buffer);
      file.writePixels(header.dataWindow().max.y + 1);
    }
    output.finish();
    if (std::rename(partial.c_str(), path.c_str()) != 0) {
      throw std::runtime_error("cannot take its name: " + reason(errno));
    }
  } catch (const std::exception& error) {
    std::remove(partial.c_str());
    throw std::runtime_error(path + ": " + error.what());
  }
}

// The read end.
struct OpenFile {
  int fd = -1;
  explicit OpenFile(const std::string& path) : fd(open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
    if (fd < 0) throw std::runtime_error("cannot be opened: " + reason(errno));
    struct stat status {};
    if (fstat(fd, &status) != 0 || !S_ISREG(status.st_mode)) {
      close(fd);
      throw std::runtime_error("is no file");
    }
  }
  ~OpenFile() { close(fd); }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
};

template <class T>
bool read_value(SandboxedChild& child, T& value) {
  return child.read(std::as_writable_bytes(std::span(&value, 1)));
}

std::string read_failure(SandboxedChild& child, std::uint32_t bytes) {
  std::string text(std::min<std::uint32_t>(bytes, 4096), ' ');
  if (!child.read(std::as_writable_bytes(std::span(text)))) return "its decoder ended early";
  // A child that was taken over must not write to the operator's terminal.
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

// The next message's payload size. Throws if it is not of the kind expected.
std::uint32_t expect(SandboxedChild& child, wire::Kind kind) {
  wire::Prefix prefix;
  if (!read_value(child, prefix)) {
    const std::string ending = child.ending();
    throw std::runtime_error(ending.empty() ? "its decoder ended early" : ending);
  }
  if (prefix.kind == wire::Kind::failure) {
    throw std::runtime_error(read_failure(child, prefix.bytes));
  }
  if (prefix.kind != kind || prefix.bytes > wire::max_payload) {
    throw std::runtime_error("its decoder went wrong");
  }
  return prefix.bytes;
}

// `lens`: where its text goes, if there is one.
wire::Header receive_header(SandboxedChild& child, std::string* lens = nullptr) {
  wire::Header header;
  if (expect(child, wire::Kind::header) != sizeof header || !read_value(child, header)) {
    throw std::runtime_error("its decoder went wrong");
  }
  if (header.lens != wire::LensNote::text) return header;
  const std::uint32_t bytes = expect(child, wire::Kind::lens);
  std::string text(std::min<std::size_t>(bytes, most_lens_text), ' ');
  if (text.size() != bytes || !child.read(std::as_writable_bytes(std::span(text)))) {
    throw std::runtime_error("its decoder went wrong");
  }
  if (lens != nullptr) *lens = std::move(text);
  return header;
}

// The simplest ratio that the file's float is nearest to.
Rational ratio_of(float value) {
  constexpr float most = 16;
  constexpr std::int64_t largest_denominator = 10'000;
  if (!(value >= 1 / most && value <= most)) return {1, 1};
  Rational before{0, 1}, ratio{1, 0};  // of its continued fraction
  double rest = static_cast<double>(value);
  while (true) {
    const auto whole = static_cast<std::int64_t>(rest);
    const Rational next{whole * ratio.num + before.num, whole * ratio.den + before.den};
    if (next.den > largest_denominator) return ratio;
    before = std::exchange(ratio, next);
    if (static_cast<float>(ratio.value()) == value) return ratio;
    rest = 1 / (rest - static_cast<double>(whole));
  }
}

ExrPicture receive(SandboxedChild& child, const ExrLimits& limits) {
  const wire::Header header = receive_header(child);
  if (header.width < 1 || header.width > wire::max_side || header.height < 1 ||
      header.height > wire::max_side || header.channels < 1 || header.channels > 4) {
    throw std::runtime_error("its decoder went wrong");
  }
  Image image{header.height, header.width, {}, header.channels};
  const std::size_t size = image.index(header.height, 0);
  if (size > limits.image_bytes / sizeof(float)) {
    throw std::runtime_error(
        "its picture of " + std::to_string(header.width) + " x " + std::to_string(header.height) +
        " x " + std::to_string(header.channels) + " floats is larger than the limit of " +
        std::to_string(limits.image_bytes >> 20) + " MiB");
  }
  // Memory follows what really arrives: a small damaged file that claims a large picture costs
  // address space only.
  image.pixels.reserve(size);
  while (image.pixels.size() < size) {
    const std::size_t count = expect(child, wire::Kind::rows) / sizeof(float);
    const std::size_t before = image.pixels.size();
    if (count == 0 || count > size - before) throw std::runtime_error("its decoder went wrong");
    image.pixels.resize(before + count);
    if (!child.read(std::as_writable_bytes(std::span(image.pixels).subspan(before)))) {
      throw std::runtime_error("its decoder ended early");
    }
  }
  expect(child, wire::Kind::end);
  if (const std::string ending = child.ending(); !ending.empty()) throw std::runtime_error(ending);

  if (header.has_primaries != 0) {
    std::array<double, 8> p{};
    for (std::size_t i = 0; i < p.size(); ++i) {
      // Files carry Rec.709 rounded to floats.
      constexpr double digits = 1e5;
      p[i] = std::round(static_cast<double>(header.primaries[i]) * digits) / digits;
    }
    const Primaries primaries{{p[0], p[1]}, {p[2], p[3]}, {p[4], p[5]}, {p[6], p[7]}};
    if (primaries != rec709) limit_infinite(image);
    convert_to_rec709(image, primaries);
  }
  return {std::move(image), ratio_of(header.pixel_aspect)};
}

// What `visit` makes of the child that decodes a file.
template <class Visit>
auto decode(const std::string& path, const ExrLimits& limits, Visit visit) {
  const std::string decoder = helper_path("platelight-decode");
  try {
    const OpenFile file(path);
    SandboxedChild child(decoder, file.fd, limits.time);
    return visit(child);
  } catch (const std::exception& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

}  // namespace

void write_exr(const std::string& path,
               std::span<const ExrPlanes> planes,
               const ExrOptions& options) {
  if (planes.empty()) throw std::invalid_argument("an EXR file needs at least one image");
  const int height = planes[0].image.height;
  const int width = planes[0].image.width;
  std::set<std::string> names;
  std::vector<Slice> slices;
  for (const auto& [image, channel_names] : planes) {
    if (image.height != height || image.width != width || image.empty()) {
      throw std::invalid_argument("the images of one EXR file need one size");
    }
    if (channel_names.size() != static_cast<std::size_t>(image.channels)) {
      throw std::invalid_argument("every channel of an EXR file needs a name");
    }
    const std::size_t pixel = channel_names.size() * sizeof(Half);
    for (std::size_t c = 0; c < channel_names.size(); ++c) {
      if (channel_names[c].empty() || !names.insert(channel_names[c]).second) {
        throw std::invalid_argument("channel names of an EXR file differ: \"" + channel_names[c] +
                                    "\"");
      }
      slices.push_back({channel_names[c], image.pixels.data() + c, pixel,
                        pixel * static_cast<std::size_t>(width)});
    }
  }
  write_slices(path, make_header(width, height, options), Imf::HALF, slices);
}

void write_exr(const std::string& path, const Image& image, const ExrOptions& options) {
  if (image.empty()) throw std::invalid_argument("an empty image cannot be written");
  std::vector<std::string> names;
  if (image.channels == 1) {
    names = {"Y"};
  } else if (image.channels == 3) {
    names = {"R", "G", "B"};
  } else if (image.channels == 4) {
    names = {"R", "G", "B", "A"};
  } else {
    throw std::invalid_argument("an EXR picture has 1, 3 or 4 channels, not " +
                                std::to_string(image.channels));
  }
  const std::size_t pixel = names.size() * sizeof(float);
  std::vector<Slice> slices;
  for (std::size_t c = 0; c < names.size(); ++c) {
    slices.push_back(
        {names[c], image.pixels.data() + c, pixel, pixel * static_cast<std::size_t>(image.width)});
  }
  write_slices(path, make_header(image.width, image.height, options), Imf::FLOAT, slices);
}

void limit_infinite(Image& image) {
  constexpr float largest_half = 65504;
  if (std::ranges::none_of(image.pixels, [](float value) { return std::isinf(value); })) return;
  const auto channels = static_cast<std::size_t>(image.channels);
  const auto is_alpha = [&](std::size_t i) { return channels == 4 && i % channels == 3; };
  float largest = largest_half;
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const float size = std::abs(image.pixels[i]);
    if (!is_alpha(i) && std::isfinite(size)) largest = std::max(largest, size);
  }
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    float& value = image.pixels[i];
    if (!is_alpha(i) && std::isinf(value)) value = std::copysign(largest, value);
  }
}

Image read_exr(const std::string& path, const ExrLimits& limits) {
  return read_exr_picture(path, limits).image;
}

ExrPicture read_exr_picture(const std::string& path, const ExrLimits& limits) {
  return decode(path, limits, [&](SandboxedChild& child) { return receive(child, limits); });
}

std::optional<LightNoise> read_exr_noise(const std::string& path, const ExrLimits& limits) {
  return decode(path, limits, [](SandboxedChild& child) -> std::optional<LightNoise> {
    const wire::Header header = receive_header(child);
    const auto is_variance = [](float value) { return std::isfinite(value) && value >= 0; };
    if (header.has_noise == 0 || !std::ranges::all_of(header.noise, is_variance)) return {};
    return LightNoise{header.noise[0], header.noise[1]};
  });
}

std::string read_exr_transfer(const std::string& path, const ExrLimits& limits) {
  return decode(path, limits, [](SandboxedChild& child) -> std::string {
    const wire::Header header = receive_header(child);
    const std::string told(header.transfer.begin(), std::ranges::find(header.transfer, '\0'));
    try {
      return told == by_response ? told : std::string(name_of(transfer_from_name(told)));
    } catch (const std::invalid_argument&) {
      return "";
    }
  });
}

std::string read_exr_lens(const std::string& path, const ExrLimits& limits) {
  return decode(path, limits, [](SandboxedChild& child) {
    std::string text;
    const wire::LensNote note = receive_header(child, &text).lens;
    if (note == wire::LensNote::too_long) {
      throw std::runtime_error("what it notes of its lens is longer than " +
                               std::to_string(most_lens_text) + " characters");
    }
    if (note == wire::LensNote::no_text || !is_lens_text(text)) {
      throw std::runtime_error("what it notes of its lens is no text");
    }
    return text;
  });
}

}  // namespace capture
