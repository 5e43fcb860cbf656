// A person before a screen, frame by frame: foreground and alpha, and how sure they are.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "capture/image.h"
#include "compositing/clean_plate.h"
#include "compositing/filtered_plate.h"
#include "compositing/key_scratch.h"
#include "compositing/key_texel.h"
#include "compositing/keyed_frame.h"
#include "compositing/plate_gaps.h"
#include "compositing/plate_watch.h"
#include "compositing/quick_light.h"

namespace compositing {

enum class KeyMethod : std::uint8_t {
  screen,      // by the colour of a screen
  difference,  // by the distance from a plate of any still background: background_subtraction.h
};

// How much is done for a frame.
enum class KeyEffort : std::uint8_t {
  // In about a third of the time, with greater errors (quick_pass.h, keying_measured.md). For
  // screens of one primary, by the table; others, and follow(), take the full way.
  quick,
  full
};

// One setting for all clips; the first two are what a difficult one may want.
struct KeySettings {
  KeyMethod method = KeyMethod::screen;
  std::optional<ScreenColour> screen_colour = {};  // none: as the plate has it
  float screen = 0.01F;                            // alpha below which the screen is clear
  float core = 0.99F;                              // alpha above which the person is whole
  float edge = 0;                                  // -1 thinner .. 1 fuller
  float despill = 1;                               // 0 none .. 1 all of the spill that is likely
  bool learned = true;        // the table; without it the plain ratio, for screens unlike any
  bool follows_light = true;  // the plate's gain is measured in each frame
  float smoothing = 1;        // of alpha over frames, in units of the noise; 0 = none
  KeyEffort effort = KeyEffort::full;
  friend bool operator==(const KeySettings&, const KeySettings&) = default;
};

// Where the key holds. Each is (height, width) of 0..255, or empty.
struct KeyMasks {
  std::vector<std::uint8_t> garbage;  // 255 = never the person
  std::vector<std::uint8_t> core;     // 255 = always the person
};

enum class KeyStatus : std::uint8_t {
  good,
  hidden,    // hardly any of the screen is in sight: light is the last that was known
  clipped,   // the screen's colour is at the camera's limit: edges are guesses
  shadowed,  // a shadow on the screen is so deep that it may pass for the person
  noisy,     // the screen's share of a pixel is uncertain
  misfit,    // what is in sight is not the plate: moved, stale, or not this screen
  thin,      // what is deep within persons is half transparent: veil, glass, or clothes that are
             // too much like the screen
  moved,     // the camera is not where it was when the plate was taken
  ghost,     // the screen is in sight where the plate shows something else: it stays for good
  unlit,     // light has changed beyond what is followed
  no_screen  // the plate shows none
};
std::string_view name_of(KeyStatus status);
inline constexpr std::string_view advice_if_thin =
    "a person is half transparent within; if that is no veil or glass, the clothes are too like "
    "the screen: hold them with a core mask, or wear others";

struct KeyReport {
  float confidence = 1;                // 0..1; falls before the picture breaks
  KeyStatus status = KeyStatus::good;  // what lowers it most
  PlateSight sight;
  PlateShift shift;    // against the plate, as it was known last: looked for in every fourth frame
  bool moved = false;  // the camera, by more than one look
  // Patches of the plate lie elsewhere, each by itself, by more than one look (PlateShift).
  bool scattered = false;
  int moved_for = 0;  // frames since the look that saw it first, this one counted
  // Share of the picture that shows the screen where the plate shows something else, as it was seen
  // last (PlateGaps): looked for as often.
  float ghost = 0;
  float soft = 0;  // share of pixels that are neither screen nor person
  float thin = 0;  // the same of what lies deep within persons, by eights of pixels
};

// Two lenses' pictures of one place differ by more than that in scale: calibrations of one lens do
// not, and a focus that breathes does.
inline constexpr float scale_of_another_lens = 0.008F;

// Whether a camera that was moved is seen larger or smaller than its plate, as another lens does
// and a tripod that is pushed does not.
inline bool is_of_another_lens(const PlateShift& shift) {
  return std::abs(shift.scale - 1) > scale_of_another_lens;
}

// Whether to look at a key before it is used, by the confidence of a frame or the mean of several:
// a screen that is at the camera's limit everywhere leaves .5, and a camera that was pushed by 4
// pixels.
inline constexpr float sure_from = 0.6F;
inline bool is_unsure(float confidence) { return confidence < sure_from; }

// Keys the frames of one clip, in order. Not thread-safe; several may run side by side.
class Keyer {
 public:
  // Throws std::invalid_argument for an empty plate, settings outside their ranges, and masks of
  // another size.
  Keyer(CleanPlate plate, const KeySettings& settings, KeyMasks masks = {});

  // (height, width, 4): premultiplied, scene-linear; alpha 0..1, foreground at least 0, all finite.
  // `keyed` keeps its memory; of a KeyedFrame, only what was or is not 0 is written. Throws
  // std::invalid_argument naming both sizes if the frame's is not the plate's.
  KeyReport key(const capture::Image& frame, KeyedFrame& keyed);
  KeyReport key(const CodedFrame& frame, KeyedFrame& keyed);
  KeyReport key(const capture::Image& frame, capture::HalfImage& keyed);
  KeyReport key(const CodedFrame& frame, capture::HalfImage& keyed);

  // For keying texels by themselves (key_texel.h): the plate as lit in the newest frame, or, where
  // frames are keyed quickly, in the last one that was followed; one that is held stays as it is.
  const LitPlate& lit() const { return light_.lit(); }
  std::shared_ptr<const LitPlate> shared_lit() const { return light_.shared_lit(); }
  // The same plate, to be seen small; made when it is asked for first.
  std::shared_ptr<const FilteredPlate> shared_filtered();
  const KeyDials& dials() const { return dials_; }

  // Follows the light without keying, for those who key texel by texel.
  KeyReport follow(const capture::Image& frame);

  // Forgets what alpha was, at a cut.
  void restart() { scratch_.has_previous = false; }

 private:
  // Pixels of (height, width, 4), and which of them may not be 0, as a KeyedFrame has it.
  struct Target {
    capture::Half* pixels;
    std::uint8_t* written;
  };
  Target target(KeyedFrame& keyed) const;
  Target target(capture::HalfImage& keyed);
  KeyReport key_light(const capture::Image& frame, const Target& target);
  KeyReport key_codes(const CodedFrame& frame, const Target& target);
  // Shares of pixels that are neither screen nor person, as KeyReport has them.
  struct Soft {
    float soft = 0, thin = 0;
  };
  static Soft soft_of(std::int64_t soft, std::int64_t thin, std::int64_t deep, std::size_t pixels);
  template <class Source>
  Soft key_rows(const Source& source,
                std::span<const typename Source::Bounds> bare,
                const Target& target);
  template <class Source>
  Soft key_quickly(const Source& source,
                   std::span<const typename Source::Bounds> bare,
                   float sigma,
                   const Target& target);
  // Noise of the screen's share in a frame's light.
  float sigma(const PlateSight& sight) const {
    return light_.sigma_under(settings_.follows_light ? sight.gain : 1);
  }
  bool glances() const;
  template <class Rows>
  void watch(const Rows& rows, float gain);
  KeyReport report(const PlateSight& sight, const Soft& soft) const;

  PlateLight light_;
  std::shared_ptr<const FilteredPlate> filtered_;
  std::optional<QuickLight> quick_;   // of quick keying
  std::vector<std::uint8_t> masked_;  // 8x8 pixels that a mask covers some of
  PlateWatch watch_;
  PlateShift shift_;
  std::optional<PlateGaps> gaps_;
  float ghost_ = 0;
  int until_look_ = 0;       // frames
  int looks_scattered_ = 0;  // how many in a row
  int looks_moved_ = 0;      // how many in a row have seen the camera elsewhere
  int moved_for_ = 0;        // frames since the first of them, it counted
  KeySettings settings_;
  KeyMasks masks_;
  KeyDials dials_;
  KeyScratch scratch_;
};

// One texel of a frame whose plate is lit, by the nearest cell: premultiplied RGB and alpha.
std::array<float, 4> key_texel(
    const LitPlate& plate, const KeyDials& dials, int y, int x, const std::array<float, 3>& light);

struct KeyPlace {
  int y, x;  // pixel of the plate
  std::array<float, 3> light;
  std::array<float, 4> cell;  // of the plate, the nearest one or filtered
};

// The same against a cell of one's own.
std::array<float, 4> key_texel(const LitPlate& plate, const KeyDials& dials, const KeyPlace& place);

// And of up to eight at once, each against its own cell; to the bit, in a fraction of the
// time. `rgba` has room for eight.
void key_texels(const LitPlate& plate,
                const KeyDials& dials,
                std::span<const KeyPlace> places,
                std::span<std::array<float, 4>, key_lanes> rgba);

}  // namespace compositing
