// How a camera's 8-bit codes follow light, recovered from a bracket or read from a file.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "capture/still.h"

namespace capture {

// Light of each code, per channel: rising, 0 at or near code 0, 1 at code 255.
struct Response {
  static constexpr int codes = 256;
  std::string name;  // for people: "sRGB", "gamma", "polynomial of degree 3", the file
  std::array<std::array<double, codes>, 3> light{};
  // Of polynomials in code / 255, highest power first, per channel; empty for other curves.
  std::array<std::vector<double>, 3> coefficients;
};

// Whether it is one that is read back from a file: of numbers from 0 to 1.05 that do not fall and
// end at .95 or above.
bool is_sound(const Response& response);

Response srgb_response();
Response linear_response();

// Reads Radiance's and hdrgen's .rsp files: one line per channel (red, green, blue) with the degree
// and the coefficients, highest power first; a single line stands for all three. Throws
// std::runtime_error with path, line and reason for malformed files, and for curves that fall
// somewhere above code 8 or do not end near 1.
Response read_rsp(const std::string& path);

// Throws std::invalid_argument if the response is no polynomial, std::runtime_error with path and
// reason if the file cannot be written.
void write_rsp(const std::string& path, const Response& response);

// One shot of a bracket in the camera's own codes.
struct CodedShot {
  Still8 still;
  double exposure_s = 0;  // > 0, as the camera claims
};

// A curve that was tried: how well it foretells shots that took no part in its fit.
struct ResponseCandidate {
  std::string name;
  int parameters = 0;
  double heldout_error = 0;  // relative RMS of light, codes 25 to 235, every code alike
  double pixel_error = 0;    // every pixel alike, without what changed between the shots
};

struct ResponseFit {
  Response response;
  std::vector<double> exposures_s;  // solved, in the shots' order; their geometric mean is kept
  double heldout_error = 0;         // of the chosen curve
  double pixel_error = 0;
  double changed = 0;  // the share of pixels that differ by over 5 robust deviations
  std::vector<ResponseCandidate> candidates;
  std::vector<std::string> warnings;  // what to know before it is used
};

// Recovers the response and the true exposures from three or more shots of one size of a scene that
// stands still for the most part, in any order.
//
// Candidates are a straight line, the sRGB curve, a power per channel, polynomials of degree 2 to 6
// through (0, 0) and (1, 1), kept rising, per channel, and a smooth rising curve of no form; the
// simplest one is taken whose error on held-out shots is within a tenth of the best, the last one
// if it is better by a fourth: it has far more parameters, and no .rsp file holds it. Shutter times
// may be off by several percent: they are solved too, held near the claimed ones. A camera whose
// codes fall somewhere as light grows has no such curve: a warning tells the codes.
//
// Mitsunaga and Nayar, "Radiometric Self Calibration", CVPR 1999, section 3. We fit logarithms of
// light, so that dark codes count by their relative error, to robust means of the codes that flat
// places have in two shots, so that what moved drops out; and we solve all ratios at once.
//
// Throws std::invalid_argument for fewer than three shots, sizes that differ, or an exposure that
// is not above 0; std::runtime_error with what to do if the shots share too little (nothing flat,
// all saturated or black, or equal exposures).
ResponseFit recover_response(std::span<const CodedShot> shots);

// How well a response foretells the shots: the relative RMS of light, codes 25 to 235, of each shot
// from its neighbours, with exposure ratios solved for this response.
struct ResponseCheck {
  double error = 0;        // every code alike
  double pixel_error = 0;  // every pixel alike, without what changed between the shots
  std::vector<double> exposures_s;
};
ResponseCheck check_response(const Response& response, std::span<const CodedShot> shots);

}  // namespace capture
