// What the chart of lenses and the program with mrcal's solver tell each other: doubles.
//
// Question: 1 for the spline, else 0; width, height; columns, rows, square in metres; number of
// views; for each corner of each view x, y and 1, or -1 if it was not seen.
// Answer: milliseconds of the solve, number of parameters (0: no solution), parameters.
#pragma once

namespace studio {

inline constexpr const char* mrcal_opencv_model = "LENSMODEL_OPENCV5";
inline constexpr const char* mrcal_splined_model =
    "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=8_Ny=8_fov_x_deg=190";

}  // namespace studio
