// Text files, whole, and numbers in them.
#include "calibrate/text_file.h"

#include <array>
#include <charconv>
#include <span>

#include "capture/files.h"

namespace calibrate {
namespace {

constexpr std::size_t largest_file = std::size_t{64} << 20U;

}  // namespace

std::string read_text_file(const std::string& path) {
  const std::vector<std::byte> bytes = capture::read_file(path, largest_file);
  std::string_view text{reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";  // of spreadsheets
  if (text.starts_with(byte_order_mark)) text.remove_prefix(byte_order_mark.size());
  return std::string(text);
}

void write_text_file(const std::string& path, std::string_view text) {
  capture::write_file(path, std::as_bytes(std::span(text)));
}

std::string to_text(double value) {
  std::array<char, 32> digits;
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  return {digits.data(), end};
}

bool parse_number(std::string_view text, double& value) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size();
}

}  // namespace calibrate
