// Clean plates for keying: from files, or from footage.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "capture/camera.h"
#include "compositing/clean_plate.h"
#include "compositing/keyer.h"
#include "studio/timed_source.h"

namespace studio {

// What a video shows of its source's picture: pictures that belong to it may be of either.
struct ShownPart {
  int whole_width = 0, whole_height = 0;   // of the source's picture
  std::optional<std::array<int, 4>> crop;  // nothing = all of it
};
ShownPart shown_part(const capture::CameraInfo& info, const VideoSource& source);

// One picture as scene-linear light; EXR and HDR as they are, others by the transfer curve. Of the
// whole picture of a video only what this shows. Throws std::runtime_error if there is none.
capture::Image read_picture(const std::string& path,
                            capture::Transfer transfer,
                            const ShownPart& shown = {});

// What speaks against a plate as one of a screen, in words; nothing of a good one. `garbage`:
// (height, width), 255 = does not count, or empty; `much`: more of it that is no screen is told.
std::optional<std::string> doubts_of_plate(const compositing::CleanPlate& plate,
                                           std::span<const std::uint8_t> garbage = {},
                                           double much = 0.1);

// What to do about a live source without a plate.
std::string needs_plate(const std::string& uri);

// How far a camera's picture has gone from its clean plate: how it is shifted, and how it is turned
// and how much larger it is, where that shows.
std::string words_for_shift(const compositing::PlateShift& shift);

// What it means that a plate's patches are scattered (PlateShift).
std::string words_for_scattered();

// What it means that so much of a frame (share of the picture) shows the screen where the clean
// plate shows something else, and what to do.
std::string words_for_ghost(float share);

// The plate in a file, with the noise that it tells (EXR of `platelight key plate`); with no path,
// from the source's own frames from first to last, of which some that are spread over them are
// looked at, as the method asks. Throws std::runtime_error if it cannot be read, was taken by
// another transfer curve than the source's (it tells), or the source is live and has no file.
compositing::CleanPlate read_clean_plate(const std::string& path,
                                         const VideoSource& source,
                                         const compositing::KeySettings& settings = {},
                                         std::array<int, 2> footage = {0, 479},
                                         const ShownPart& shown = {});

}  // namespace studio
