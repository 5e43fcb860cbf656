// What the chart of lenses and the programs with other tools' solvers tell each other: doubles.
//
// Question: which model, of those that the program knows; width, height; columns, rows, square in
// metres; number of views; for each corner of each view x, y and 1, or -1 if it was not seen.
// Answer: milliseconds of the solve, number of parameters (0: no solution), parameters; or 0 and
// the length of a text as a number below 0, then in bytes what the tool said instead.
#pragma once

#include <cstddef>
#include <cstdio>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "calibrate/lens_solve.h"

namespace studio {

inline constexpr const char* mrcal_opencv_model = "LENSMODEL_OPENCV5";
inline constexpr const char* mrcal_splined_model =
    "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=8_Ny=8_fov_x_deg=190";

struct SolverQuestion {
  int model = 0;  // platelight-mrcal: 1 for the spline
  calibrate::LensProblem problem;
};

std::vector<double> to_doubles(const SolverQuestion& question);

// From a solver's standard input; nothing if it ends early.
std::optional<SolverQuestion> read_question(std::FILE* file);

void write_answer(std::FILE* file, double time_ms, std::span<const double> parameters);
void write_refusal(std::FILE* file, std::string_view reason);

}  // namespace studio
