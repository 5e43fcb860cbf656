// Pictures as cameras sent them, in files.
#include "capture/coded_file.h"

#include <array>
#include <bit>
#include <cstring>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "capture/files.h"
#include "capture/libav.h"

namespace capture {
namespace {

constexpr std::array magic{std::byte{'P'}, std::byte{'L'}, std::byte{'C'}, std::byte{'O'},
                           std::byte{'D'}, std::byte{'E'}, std::byte{'D'}, std::byte{'1'}};
constexpr std::size_t numbers = 8;
constexpr std::size_t header_bytes = magic.size() + 4 * numbers + 8;

template <class Number>
void append(std::vector<std::byte>& bytes, Number number) {
  for (std::size_t i = 0; i < sizeof(number); ++i) {
    bytes.push_back(static_cast<std::byte>(number >> (8 * i) & 0xff));
  }
}

template <class Number>
Number take(std::span<const std::byte>& bytes) {
  Number number = 0;
  for (std::size_t i = 0; i < sizeof(number); ++i) {
    number |= static_cast<Number>(bytes[i]) << (8 * i);
  }
  bytes = bytes.subspan(sizeof(number));
  return number;
}

int side_of(std::uint32_t number) {
  // Larger ones are refused by whoever reads the picture.
  return number <= 1U << 20U ? static_cast<int>(number) : 0;
}

}  // namespace

bool is_coded_file(const std::string& path) {
  return std::filesystem::path(path).extension() == ".coded";
}

void write_coded_file(const std::string& path, const CodedPicture& picture) {
  const CodedLayout& layout = picture.layout;
  std::vector<std::byte> bytes;
  bytes.reserve(header_bytes + picture.bytes.size());
  bytes.insert(bytes.end(), magic.begin(), magic.end());
  for (const std::uint32_t number :
       {layout.fourcc, static_cast<std::uint32_t>(layout.width),
        static_cast<std::uint32_t>(layout.height), static_cast<std::uint32_t>(layout.row_bytes),
        layout.colour_space, layout.ycbcr_encoding, layout.quantization, layout.transfer}) {
    append(bytes, number);
  }
  append(bytes, static_cast<std::uint64_t>(picture.bytes.size()));
  bytes.insert(bytes.end(), picture.bytes.begin(), picture.bytes.end());
  write_file(path, bytes);
}

CodedPicture read_coded_file(const std::string& path) {
  const auto fail = [&](const std::string& why) {
    throw std::runtime_error("cannot read " + path + ": " + why);
  };
  const std::vector<std::byte> bytes = read_file(path);
  if (bytes.size() < header_bytes || std::memcmp(bytes.data(), magic.data(), magic.size()) != 0) {
    fail("it is no picture of a recording");
  }
  std::span<const std::byte> rest = std::span(bytes).subspan(magic.size());
  CodedPicture picture;
  CodedLayout& layout = picture.layout;
  layout.fourcc = take<std::uint32_t>(rest);
  layout.width = side_of(take<std::uint32_t>(rest));
  layout.height = side_of(take<std::uint32_t>(rest));
  layout.row_bytes = take<std::uint32_t>(rest);
  layout.colour_space = take<std::uint32_t>(rest);
  layout.ycbcr_encoding = take<std::uint32_t>(rest);
  layout.quantization = take<std::uint32_t>(rest);
  layout.transfer = take<std::uint32_t>(rest);
  const auto told = take<std::uint64_t>(rest);
  if (layout.width < 1 || layout.height < 1) fail("its picture has no size");
  if (told != rest.size()) {
    fail("it should hold " + std::to_string(told) + " bytes of picture, and holds " +
         std::to_string(rest.size()));
  }
  picture.bytes.assign(rest.begin(), rest.end());
  return picture;
}

CodedFileReader::CodedFileReader(LightCurves curves) : curves_(std::move(curves)) {}

std::string CodedFileReader::read(const std::string& path, Image& image) {
  const CodedPicture picture = read_coded_file(path);
  try {
    if (!reader_ || picture.layout != layout_) {
      reader_.reset();
      reader_ = std::make_unique<CodedPictureReader>(picture.layout, curves_);
      layout_ = picture.layout;
    }
    // What is wrong with it was told when it was recorded.
    static_cast<void>(reader_->read(picture.bytes, {0, 0, layout_.width, layout_.height}, image));
  } catch (const std::runtime_error& error) {
    throw std::runtime_error("cannot read " + path + ": " + error.what());
  }
  return "as its camera sent it: " + reader_->description();
}

}  // namespace capture
