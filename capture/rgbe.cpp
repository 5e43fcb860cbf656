// Radiance pictures. Ward, "Real Pixels", Graphics Gems II, 1991; Radiance's file format notes.
#include "capture/rgbe.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "capture/files.h"
#include "capture/primaries.h"

namespace capture {
namespace {

constexpr int max_side = 16384;
constexpr std::size_t shortest_rle = 8;  // scan lines of other lengths are never new-style encoded
constexpr std::size_t longest_rle = 32767;
constexpr int exponent_bias = 128;
constexpr int mantissa_bits = 8;

// The picture as it lies in the file.
struct Layout {
  int scan_lines = 0;
  int pixels = 0;        // of a scan line
  bool columns = false;  // scan lines are columns
  bool from_right = false;
  bool from_bottom = false;

  int height() const { return columns ? pixels : scan_lines; }
  int width() const { return columns ? scan_lines : pixels; }
};

struct PictureHeader {
  Layout layout;
  std::array<double, 3> scale{1, 1, 1};  // from file values to radiance
  Primaries primaries = rec709;
};

// Bytes with a position; running out of them is the file's fault.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::uint8_t byte() {
    if (position_ >= bytes_.size()) throw std::runtime_error("ends too early");
    return static_cast<std::uint8_t>(bytes_[position_++]);
  }
  Rgbe pixel() { return {byte(), byte(), byte(), byte()}; }
  std::optional<Rgbe> peek_pixel() const {
    if (bytes_.size() - position_ < sizeof(Rgbe)) return std::nullopt;
    Rgbe pixel{};
    std::memcpy(pixel.data(), &bytes_[position_], sizeof(Rgbe));
    return pixel;
  }
  std::string line() {
    constexpr std::size_t longest_line = 1 << 16;
    std::string text;
    for (char c = static_cast<char>(byte()); c != '\n'; c = static_cast<char>(byte())) {
      if (text.size() == longest_line) throw std::runtime_error("has an endless header line");
      text += c;
    }
    if (!text.empty() && text.back() == '\r') text.pop_back();
    ++lines_;
    return text;
  }
  int lines() const { return lines_; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t position_ = 0;
  int lines_ = 0;
};

// Exactly `count` numbers, without regard to locale.
std::vector<double> numbers(std::string_view text, std::size_t count) {
  std::vector<double> values;
  const char* at = text.data();
  const char* const end = at + text.size();
  while (true) {
    while (at != end && (*at == ' ' || *at == '\t')) ++at;
    if (at == end) break;
    double value = 0;
    const auto [rest, error] = std::from_chars(at, end, value);
    if (error != std::errc() || !std::isfinite(value)) {
      throw std::runtime_error("has a malformed number");
    }
    values.push_back(value);
    at = rest;
  }
  if (values.size() != count) throw std::runtime_error("has a wrong count of numbers");
  return values;
}

void divide_out(std::array<double, 3>& scale, std::span<const double> factors) {
  for (std::size_t c = 0; c < scale.size(); ++c) {
    const double factor = factors.size() == 1 ? factors[0] : factors[c];
    if (!(factor > 0)) throw std::runtime_error("has a factor that is not above 0");
    scale[c] /= factor;
  }
}

void read_variable(const std::string& line, PictureHeader& header, bool& known_format) {
  const auto value_of = [&](std::string_view key) -> std::optional<std::string_view> {
    if (!line.starts_with(key)) return std::nullopt;
    return std::string_view(line).substr(key.size());
  };
  if (const auto format = value_of("FORMAT=")) {
    if (*format == "32-bit_rle_xyze") {
      header.primaries = xyz;
    } else if (*format != "32-bit_rle_rgbe") {
      throw std::runtime_error("has a FORMAT that is neither 32-bit_rle_rgbe nor 32-bit_rle_xyze");
    }
    known_format = true;
  } else if (const auto exposure = value_of("EXPOSURE=")) {
    divide_out(header.scale, numbers(*exposure, 1));
  } else if (const auto correction = value_of("COLORCORR=")) {
    divide_out(header.scale, numbers(*correction, 3));
  } else if (const auto chromaticities = value_of("PRIMARIES=")) {
    const std::vector<double> p = numbers(*chromaticities, 8);
    // Photoshop writes eight zeros where it knows nothing.
    const bool known = std::any_of(p.begin(), p.end(), [](double value) { return value != 0; });
    if (known) header.primaries = {{p[0], p[1]}, {p[2], p[3]}, {p[4], p[5]}, {p[6], p[7]}};
  } else if (const auto gamma = value_of("GAMMA=")) {
    if (numbers(*gamma, 1)[0] != 1) throw std::runtime_error("is not linear");
  }
}

Layout read_resolution(const std::string& line) {
  std::istringstream words(line);
  words.imbue(std::locale::classic());
  std::string first;
  std::string second;
  long scan_lines = 0;
  long pixels = 0;
  std::string rest;
  const bool read = static_cast<bool>(words >> first >> scan_lines >> second >> pixels);
  const auto axis = [](const std::string& word, char name) {
    return word.size() == 2 && (word[0] == '+' || word[0] == '-') && word[1] == name;
  };
  const bool rows = axis(first, 'Y') && axis(second, 'X');
  const bool columns = axis(first, 'X') && axis(second, 'Y');
  if (!read || words >> rest || !(rows || columns)) {
    throw std::runtime_error("has a malformed resolution line");
  }
  if (scan_lines < 1 || pixels < 1 || scan_lines > max_side || pixels > max_side) {
    throw std::runtime_error("is " + std::to_string(columns ? scan_lines : pixels) + " x " +
                             std::to_string(columns ? pixels : scan_lines) + " pixels; 1 to " +
                             std::to_string(max_side) + " a side can be read");
  }
  const std::string& vertical = rows ? first : second;
  const std::string& horizontal = rows ? second : first;
  return {static_cast<int>(scan_lines), static_cast<int>(pixels), columns, horizontal[0] == '-',
          vertical[0] == '+'};
}

PictureHeader read_header(Reader& reader) {
  if (reader.byte() != '#' || reader.byte() != '?') {
    throw std::runtime_error("is no Radiance picture");
  }
  PictureHeader header;
  bool known_format = false;
  try {
    for (std::string line = reader.line(); !line.empty(); line = reader.line()) {
      read_variable(line, header, known_format);
    }
    if (!known_format) throw std::runtime_error("has no FORMAT");
    header.layout = read_resolution(reader.line());
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(std::string(error.what()) + " (at line " +
                             std::to_string(reader.lines()) + " of its header)");
  }
  return header;
}

void read_new_runs(Reader& reader, std::span<Rgbe> scan_line) {
  constexpr std::uint8_t longest_literal = 128;
  for (std::size_t component = 0; component < 4; ++component) {
    for (std::size_t i = 0; i < scan_line.size();) {
      const std::uint8_t code = reader.byte();
      const bool run = code > longest_literal;
      const std::size_t count = run ? code - longest_literal : code;
      if (count == 0 || count > scan_line.size() - i) {
        throw std::runtime_error("has a run beyond its scan line's end");
      }
      std::uint8_t value = run ? reader.byte() : std::uint8_t{0};
      for (const std::size_t end = i + count; i < end; ++i) {
        if (!run) value = reader.byte();
        scan_line[i][component] = value;
      }
    }
  }
}

// Pixels, where (1, 1, 1, n) repeats the one before n times; further such pixels count in steps of
// 256, 65,536 ...
void read_old_runs(Reader& reader, std::span<Rgbe> scan_line) {
  unsigned shift = 0;
  for (std::size_t i = 0; i < scan_line.size();) {
    const Rgbe pixel = reader.pixel();
    if (pixel[0] != 1 || pixel[1] != 1 || pixel[2] != 1) {
      scan_line[i++] = pixel;
      shift = 0;
      continue;
    }
    const std::size_t count = shift < 32 ? std::size_t{pixel[3]} << shift : scan_line.size();
    if (i == 0 || count > scan_line.size() - i) {
      throw std::runtime_error("has a run beyond its scan line's end");
    }
    std::fill_n(scan_line.begin() + static_cast<std::ptrdiff_t>(i), count, scan_line[i - 1]);
    i += count;
    shift += 8;
  }
}

void read_scan_line(Reader& reader, std::span<Rgbe> scan_line) {
  const std::optional<Rgbe> start = reader.peek_pixel();
  const bool new_runs = scan_line.size() >= shortest_rle && scan_line.size() <= longest_rle &&
                        start && (*start)[0] == 2 && (*start)[1] == 2 && (*start)[2] < 128;
  if (!new_runs) {
    read_old_runs(reader, scan_line);
    return;
  }
  const Rgbe marker = reader.pixel();
  if ((std::size_t{marker[2]} << 8 | marker[3]) != scan_line.size()) {
    throw std::runtime_error("has a scan line of another length than its header says");
  }
  read_new_runs(reader, scan_line);
}

Image decode(std::span<const std::byte> bytes, std::size_t max_image_bytes) {
  Reader reader(bytes);
  const PictureHeader header = read_header(reader);
  const Layout& layout = header.layout;
  const auto length = static_cast<std::size_t>(layout.pixels);
  const std::size_t size = length * static_cast<std::size_t>(layout.scan_lines);
  if (size > max_image_bytes / (3 * sizeof(float))) {
    throw std::runtime_error("its picture is larger than the limit of " +
                             std::to_string(max_image_bytes >> 20) + " MiB");
  }
  // Grows with what is really there, so that a short file that claims a large picture costs little.
  std::vector<Rgbe> pixels;
  for (int line = 0; line < layout.scan_lines; ++line) {
    pixels.resize(pixels.size() + length);
    read_scan_line(reader, std::span(pixels).last(length));
  }

  Image image = make_image(layout.height(), layout.width(), 3);
  for (int line = 0; line < layout.scan_lines; ++line) {
    for (int i = 0; i < layout.pixels; ++i) {
      const int across = layout.columns ? line : i;
      const int down = layout.columns ? i : line;
      const int x = layout.from_right ? image.width - 1 - across : across;
      const int y = layout.from_bottom ? image.height - 1 - down : down;
      const auto radiance = radiance_from_rgbe(
          pixels[static_cast<std::size_t>(line) * length + static_cast<std::size_t>(i)]);
      for (std::size_t c = 0; c < radiance.size(); ++c) {
        image.at(y, x, static_cast<int>(c)) =
            static_cast<float>(static_cast<double>(radiance[c]) * header.scale[c]);
      }
    }
  }
  convert_to_rec709(image, header.primaries);
  return image;
}

class Writer {
 public:
  void byte(std::size_t value) { bytes_.push_back(static_cast<std::byte>(value)); }
  void text(std::string_view text) {
    for (const char c : text) byte(static_cast<unsigned char>(c));
  }
  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

std::size_t run_length(std::span<const Rgbe> pixels, std::size_t component) {
  constexpr std::size_t longest = 127;
  std::size_t count = 1;
  while (count < pixels.size() && count < longest &&
         pixels[count][component] == pixels[0][component]) {
    ++count;
  }
  return count;
}

void write_runs(Writer& out, std::span<const Rgbe> scan_line) {
  constexpr std::size_t worthwhile = 4;  // shorter runs cost more than they save
  constexpr std::size_t longest_literal = 128;
  for (const std::size_t value :
       {std::size_t{2}, std::size_t{2}, scan_line.size() >> 8, scan_line.size() & 0xFF}) {
    out.byte(value);
  }
  for (std::size_t component = 0; component < 4; ++component) {
    for (std::size_t i = 0; i < scan_line.size();) {
      const std::size_t run = run_length(scan_line.subspan(i), component);
      if (run >= worthwhile) {
        out.byte(128 + run);
        out.byte(scan_line[i][component]);
        i += run;
        continue;
      }
      std::size_t end = i + run;
      while (end < scan_line.size() && end - i < longest_literal &&
             run_length(scan_line.subspan(end), component) < worthwhile) {
        ++end;
      }
      end = std::min(end, i + longest_literal);
      out.byte(end - i);
      for (; i < end; ++i) out.byte(scan_line[i][component]);
    }
  }
}

}  // namespace

Rgbe rgbe_from_radiance(float r, float g, float b) {
  static constexpr float largest = 0x1p127F * (255.0F / 256.0F);  // 255 at the last exponent
  const auto storable = [](float value) {
    return value > 0 ? std::min(value, largest) : 0.0F;  // NaN compares false
  };
  const std::array<float, 3> colour{storable(r), storable(g), storable(b)};
  const float brightest = std::max({colour[0], colour[1], colour[2]});
  int exponent = 0;
  std::frexp(brightest, &exponent);
  if (brightest == 0 || exponent + exponent_bias < 1) return {};
  Rgbe rgbe{};
  for (std::size_t c = 0; c < colour.size(); ++c) {
    rgbe[c] = static_cast<std::uint8_t>(std::ldexp(colour[c], mantissa_bits - exponent));
  }
  rgbe[3] = static_cast<std::uint8_t>(exponent + exponent_bias);
  return rgbe;
}

std::array<float, 3> radiance_from_rgbe(Rgbe rgbe) {
  if (rgbe[3] == 0) return {};
  const float step = std::ldexp(1.0F, rgbe[3] - exponent_bias - mantissa_bits);
  return {(static_cast<float>(rgbe[0]) + 0.5F) * step, (static_cast<float>(rgbe[1]) + 0.5F) * step,
          (static_cast<float>(rgbe[2]) + 0.5F) * step};
}

Image read_rgbe(const std::string& path, std::size_t max_image_bytes) {
  const std::vector<std::byte> bytes = read_file(path);
  try {
    return decode(bytes, max_image_bytes);
  } catch (const std::exception& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

void write_rgbe(const std::string& path, const Image& image) {
  if (image.channels != 3 || image.empty()) {
    throw std::invalid_argument("a Radiance picture has 3 channels, not " +
                                std::to_string(image.channels));
  }
  Writer out;
  out.text("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y " + std::to_string(image.height) + " +X " +
           std::to_string(image.width) + "\n");
  const auto width = static_cast<std::size_t>(image.width);
  std::vector<Rgbe> scan_line(width);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const float* rgb = &image.pixels[image.index(y, x)];
      if (!std::isfinite(rgb[0]) || !std::isfinite(rgb[1]) || !std::isfinite(rgb[2])) {
        throw std::invalid_argument("a Radiance picture holds finite values only");
      }
      scan_line[static_cast<std::size_t>(x)] = rgbe_from_radiance(rgb[0], rgb[1], rgb[2]);
    }
    if (width >= shortest_rle && width <= longest_rle) {
      write_runs(out, scan_line);
    } else {
      for (const Rgbe& pixel : scan_line) {
        for (const std::uint8_t value : pixel) out.byte(value);
      }
    }
  }
  write_file(path, out.bytes());
}

}  // namespace capture
