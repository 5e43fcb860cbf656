// Through which lens a clean plate was filmed, and whether that is the lens of its clip.
#pragma once

#include <optional>
#include <string>

#include "calibrate/lens.h"
#include "studio/clean_plates.h"

namespace studio {

// What people know a lens by: "a focal length of 1043.2 px (LENSMODEL_OPENCV8)".
std::string words_for_lens(const calibrate::Lens& lens);

// How far apart, in pixels of the plate, the same directions lie through both lenses at most, in
// the middle of the whole picture, once a turn of the camera is taken out: of poses nothing is
// said. Nothing if that is no more than calibrations of one lens may differ by (.8 % of
// the middle's radius, but no less than a pixel), or no direction is in both. Either lens is of the
// whole picture or of what is shown of it. Throws as calibrate::check().
std::optional<double> apart_px(const calibrate::Lens& plate,
                               const calibrate::Lens& clip,
                               const ShownPart& shown = {});

// The lens that a clean plate's file notes; nothing of what is no EXR, or notes none. Throws
// std::runtime_error with path and reason if it notes what is no lens: that plate would be taken
// for one of any lens.
std::optional<calibrate::Lens> read_plate_lens(const std::string& plate);

// Throws std::runtime_error that names both files and both lenses, how far apart they are and what
// to do, if a clean plate's file notes another lens than its clip's; or as read_plate_lens(), or if
// the lens is of a picture of another size than the plate. `clip_lens`: of the part of the picture
// that is shown; `clip_name`: its file, "" = written in the set.
void require_plate_of_lens(const std::string& plate,
                           const calibrate::Lens& clip_lens,
                           const std::string& clip_name,
                           const ShownPart& shown);

}  // namespace studio
