// Made footage from which the demo's cameras are calibrated: boards, surveyed markers, a lamp.
#pragma once

#include <filesystem>

#include "calibrate/board.h"
#include "render/made_studio.h"

namespace studio {

// What is held before both cameras: a chessboard of 9x6 inner corners.
calibrate::Board demo_board();

// How well the markers were seen: standard deviation of each coordinate, pixels.
inline constexpr double demo_marker_noise_px = 0.25;

// How much later the probe stamps what both cameras see: its recording begins before the plate's.
double demo_offset_s(const render::MadeStudio& studio);

// What both cameras see without any of it: radiance of their pictures' sizes.
struct DemoRooms {
  capture::Image plate;
  capture::Image probe;
};

// Writes into `dir`, which is made if it is not there:
//
//   plate/00.png...      the board before the plate camera, all over its picture
//   probe/00.png...      and before the fish-eye, out to its rim
//   plate_markers.toml   marks on the ground and on poles around the car's place, surveyed
//   probe_markers.toml   the same ones, as the fish-eye sees them
//   patches.toml         the grey card in the plate
//   plate_lamp.mkv       ten seconds in which a lamp is switched at random
//   probe_lamp.mkv       the same of the fish-eye; its recording begins as much before the plate's
//                        as that of the take does
//   truth.json           poses, offset, and how each board stood
//
// Both lenses are those of the demo's cameras, at their pictures' sizes: below 320 pixels boards
// are too small to be found. The same studio writes the same bytes. Throws std::runtime_error with
// path and reason.
void write_demo_calibration(const std::filesystem::path& dir,
                            const render::MadeStudio& studio,
                            const DemoRooms& rooms);

}  // namespace studio
