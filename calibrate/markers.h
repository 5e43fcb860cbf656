// Surveyed points of the set, and the pixels in which they are seen.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "calibrate/board.h"
#include "calibrate/lens.h"
#include "calibrate/pose.h"
#include "calibrate/sight.h"

namespace calibrate {

// A point of the set in one picture.
struct Marker {
  std::string name;     // for people; a point seen in several pictures keeps its name
  Vec3 p_set;           // metres
  Vec2 q;               // pixels
  std::string picture;  // which picture, where there are several
  int line = 0;         // of its file, that tells the pixel; 0 = of no file
  friend bool operator==(const Marker&, const Marker&) = default;
};

// Reads [[marker]] tables (files.md). Throws std::runtime_error with path, line and key: what is
// missing, of the wrong kind, not finite, beyond 1e6, or unknown; a name that is twice in a
// picture, or at two places in the set.
std::vector<Marker> read_markers(const std::string& path);

// Of one picture; with an empty name all of them. Throws std::runtime_error naming the pictures, if
// there are several and no name, or none of that name.
std::vector<Marker> markers_in(std::span<const Marker> markers, const std::string& picture);

// The corners of a board that lies in the set, as seen in a picture; named "row,column" from 0.
// Throws std::invalid_argument if the view has not as many corners as the board.
std::vector<Marker> markers_of(const Board& board,
                               const BoardView& view,
                               const Pose& set_from_board);

// What register_camera takes. Throws std::runtime_error naming the marker, and its line, whose
// pixel the lens does not see, or lies outside of the lens's picture.
std::vector<Sight> sights_of(const Lens& lens, std::span<const Marker> markers);

}  // namespace calibrate
