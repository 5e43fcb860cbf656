// From the kernel's scene-linear halves to the codes of a display, by tables made once.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "capture/image.h"
#include "compositing/tone.h"

namespace compositing {

class ViewTransform;

// Which display and view; "" is the config's default. A name that is none is refused with the list
// of those that are.
struct DisplaySettings {
  std::string display = "Rec.1886";     // or "sRGB"
  std::string view = "Un-tone-mapped";  // keeps the plate's own look; or "ACES SDR"
  int table_size = 65;                  // nodes per axis of a baked view's table, 2 to 129
  std::string config_file = {};         // an OpenColorIO config; "" = the one in code
  std::string working_space = {};       // its name of linear Rec.709; "" = found by known names
  std::string look_file = {};           // a .clf or .cube of working values, before the view
};

// Immutable once made: any number of threads may convert.
//
// Where the view treats each channel alone, as the un-tone-mapped views do, there is one entry for
// each of the 65,536 halves: exact to rounding. Any other view is a table of table_size^3 nodes,
// read by tetrahedral interpolation, its nodes spread about logarithmically from the value where
// the view no longer changes to as far below 0 as colours outside the gamut lie. NaN becomes 0,
// infinities act as the largest half.
class Display {
 public:
  // Throws like ViewTransform, std::invalid_argument for a table_size out of range, and
  // std::runtime_error if the view gives values that are not finite.
  explicit Display(const DisplaySettings& settings = {});

  // Converts a whole (height, width, 4) image, on all threads, to (height, width, 3) codes, or to
  // 0xffRRGGBB words as windows take them. Alpha is not applied: RGB is the finished picture.
  // Returns how many pixels had a NaN. Throws std::invalid_argument if the sizes do not agree.
  // `tone` is applied before the view; none by default.
  std::int64_t to_rgb8(const capture::HalfImage& rgba,
                       std::span<std::uint8_t> rgb,
                       const ToneCurve& tone = {}) const;
  std::int64_t to_rgb16(const capture::HalfImage& rgba,
                        std::span<std::uint16_t> rgb,
                        const ToneCurve& tone = {}) const;
  std::int64_t to_rgb32(const capture::HalfImage& rgba,
                        std::span<std::uint32_t> words,
                        const ToneCurve& tone = {}) const;

  // The same for a run of pixels (some rows, a piece of one) on the calling thread: for callers
  // that go tile by tile. Allocates nothing.
  std::int64_t to_rgb8(std::span<const capture::Half> rgba,
                       std::span<std::uint8_t> rgb,
                       const ToneCurve& tone = {}) const;
  std::int64_t to_rgb16(std::span<const capture::Half> rgba,
                        std::span<std::uint16_t> rgb,
                        const ToneCurve& tone = {}) const;
  std::int64_t to_rgb32(std::span<const capture::Half> rgba,
                        std::span<std::uint32_t> words,
                        const ToneCurve& tone = {}) const;

  // Whether the exact tables serve.
  bool separable() const { return nodes_.empty(); }

 private:
  void make_exact_tables(const ViewTransform& view, const DisplaySettings& settings);
  void bake(const ViewTransform& view);
  template <typename Code, typename Emit>
  void emit_codes(std::span<const capture::Half> rgba,
                  const std::vector<Code>& table,
                  Emit emit) const;
  template <typename Code, typename Emit>
  std::int64_t convert(std::span<const capture::Half> rgba,
                       const std::vector<Code>& table,
                       const ToneCurve& tone,
                       Emit emit) const;
  template <typename Value, typename Run>
  std::int64_t convert_image(const capture::HalfImage& rgba,
                             std::span<Value> values,
                             std::size_t values_per_pixel,
                             Run run) const;

  std::vector<std::uint16_t> codes_;  // separable: (3, 65536) codes of 16 bits
  std::vector<std::uint8_t> bytes_;   // separable: (3, 65536) codes of 8 bits
  std::vector<float> positions_;      // baked: place of each half on an axis, 0..table_size - 1
  std::vector<float> nodes_;          // baked: (r, g, b, 4) display values 0..1
  int table_size_ = 0;
};

}  // namespace compositing
