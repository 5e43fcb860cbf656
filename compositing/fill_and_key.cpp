// Fill and key of a finished picture, for an external keyer that has the plate.
#include "compositing/fill_and_key.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace compositing {
namespace {

constexpr std::size_t half_count = 65536;
constexpr capture::Half half_one = 0x3c00;

// Nearest to product / 255, for products of two codes.
constexpr int divided(int product) {
  const int sum = product + 128;
  return (sum + (sum >> 8)) >> 8;
}

// What share of codes is left where a share of light is, by the light's bits: the display's own
// curve, from 0 at black to 1 at white.
std::vector<float> shares_of_codes(const Display& display) {
  std::vector<capture::Half> light(half_count * 4);
  for (std::size_t bits = 0; bits < half_count; ++bits) {
    const float share = capture::float_from_half(static_cast<capture::Half>(bits));
    const float within = std::isnan(share) ? 0.0F : std::clamp(share, 0.0F, 1.0F);
    std::fill_n(light.begin() + static_cast<std::ptrdiff_t>(bits * 4), 4,
                capture::half_from_float(within));
  }
  std::vector<std::uint16_t> codes(half_count * 3);
  display.to_rgb16(light, codes);
  const auto code_at = [&](std::size_t bits) { return static_cast<float>(codes[bits * 3 + 1]); };
  const float black = code_at(capture::half_from_float(0));
  const float range = std::max(code_at(capture::half_from_float(1)) - black, 1.0F);
  std::vector<float> shares(half_count);
  for (std::size_t bits = 0; bits < half_count; ++bits) {
    shares[bits] = std::clamp((code_at(bits) - black) / range, 0.0F, 1.0F);
  }
  return shares;
}

// Rounded down, so that the fill seldom comes out below 0. Whatever is no number hides the plate.
int passing_codes(capture::Half alpha, capture::Half matte, const std::vector<float>& shares) {
  const float clear = std::min(1 - capture::float_from_half(alpha), 1.0F);
  const float left = 1 - capture::float_from_half(matte);
  if (!(clear > 0) || !(left > 0)) return 0;
  const float lit = std::min(left / clear, 1.0F);
  return static_cast<int>(255 * clear * shares[capture::half_from_float(lit)]);
}

// The most that may pass of these codes of the plate so that no fill is negative; exact where it is
// at most 255. Without a branch: in shadows, a raised key is as likely as not.
float most_passing(const std::uint8_t* programme, const std::uint8_t* plate) {
  const auto most = [&](int c) {
    return static_cast<float>(programme[c] * 255 + 127) / static_cast<float>(plate[c]);
  };
  return std::min(std::min(most(0), most(1)), most(2));
}

void require(bool holds, const std::string& reason) {
  if (!holds) throw std::invalid_argument(reason);
}

}  // namespace

FillAndKey::FillAndKey(std::shared_ptr<const Display> display) : display_(std::move(display)) {
  require(display_ != nullptr, "fill and key need the display whose codes they are");
  passed_ = shares_of_codes(*display_);
  clear_.resize(half_count);
  for (std::size_t bits = 0; bits < half_count; ++bits) {
    const int passing = passing_codes(0, static_cast<capture::Half>(bits), passed_);
    clear_[bits] = static_cast<std::uint8_t>(passing);
  }
}

std::int64_t FillAndKey::split(std::span<const std::uint8_t> programme,
                               const capture::HalfImage& rgba,
                               const capture::HalfImage& plate,
                               const capture::HalfImage& matte,
                               const ToneCurve& tone,
                               std::span<std::uint8_t> fill,
                               std::span<std::uint8_t> key) {
  const auto width = static_cast<std::size_t>(std::max(plate.width, 0));
  const auto height = static_cast<std::size_t>(std::max(plate.height, 0));
  const std::size_t pixels = width * height;
  require(programme.size() == pixels * 3 && rgba.pixels.size() == pixels * 4 &&
              plate.pixels.size() == pixels * 3 && matte.pixels.size() == pixels,
          "programme, picture, plate and matte are not of one size");
  require(fill.size() == pixels * 3 && key.size() == pixels,
          "fill and key need room for " + std::to_string(pixels) + " pixels");
  row_.resize(width * 4);
  codes_.resize(width * 3);
  mixed_.resize(width);
  std::int64_t raised = 0;
  for (std::size_t first = 0; first < pixels; first += width) {
    // Most pixels are plate alone, or hide it; only the others need the plate's codes.
    std::size_t count = 0;
    for (std::size_t at = first; at < first + width; ++at) {
      const capture::Half* const over = plate.pixels.data() + at * 3;
      const capture::Half* const shown = rgba.pixels.data() + at * 4;
      if (shown[3] == half_one) {
        std::copy_n(programme.data() + at * 3, 3, fill.data() + at * 3);
        key[at] = 255;
      } else if (matte.pixels[at] == 0 && shown[3] == 0 && std::equal(over, over + 3, shown)) {
        std::fill_n(fill.data() + at * 3, 3, std::uint8_t{0});
        key[at] = 0;
      } else {
        std::copy_n(over, 3, row_.data() + count * 4);
        mixed_[count++] = at;
      }
    }
    display_->to_rgb8(std::span(row_).first(count * 4), std::span(codes_).first(count * 3), tone);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t at = mixed_[i];
      const capture::Half alpha = rgba.pixels[at * 4 + 3], matted = matte.pixels[at];
      const std::uint8_t* const over = codes_.data() + i * 3;
      const std::uint8_t* const shown = programme.data() + at * 3;
      const int asked = alpha == 0 ? clear_[matted] : passing_codes(alpha, matted, passed_);
      const int passing =
          static_cast<int>(std::min(static_cast<float>(asked), most_passing(shown, over)));
      raised += passing < asked;
      for (int c = 0; c < 3; ++c) {
        fill[at * 3 + static_cast<std::size_t>(c)] =
            static_cast<std::uint8_t>(shown[c] - divided(passing * over[c]));
      }
      key[at] = static_cast<std::uint8_t>(255 - passing);
    }
  }
  return raised;
}

}  // namespace compositing
