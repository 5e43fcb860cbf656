// What calibration tells of a camera, and its files: how codes follow light, and their noise.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "capture/hdr.h"
#include "capture/photon_transfer.h"
#include "capture/response.h"

namespace capture {

// A linear sensor's codes, per channel: red, green, blue; of a grey one three times the same.
struct LinearResponse {
  double full_code = 255;  // the code of value 1, as pictures are read
  std::array<double, 3> black{0, 0, 0};
  std::array<double, 3> white{255, 255, 255};  // saturation, which has light 1
  std::array<double, 3> gain{0, 0, 0};         // electrons per code; 0 = unknown
  std::array<double, 3> read_noise{0, 0, 0};   // codes
  NoiseModel noise;                            // of light
};

struct CameraResponse {
  Response curve;                        // light of 8-bit codes; of linear sensors as well
  std::optional<LinearResponse> linear;  // goes before the curve

  // Light of a picture's value, 0..1 and somewhat beyond: 0 = black, 1 = saturated.
  double light(int channel, double value) const;
};

CameraResponse response_of(const PhotonTransfer& transfer, double full_code);

// Reads a .toml file of write_response, or a .rsp file (response.h). Throws std::runtime_error with
// path, line and reason for files that are malformed, have unknown keys, or curves that fall.
CameraResponse read_response(const std::string& path);

// Writes a .toml file: `model = "linear"` with the keys of LinearResponse and a table [noise] with
// read, shot and saturation; or `model = "curve"`, `name`, and the 256 lights of `red`, `green` and
// `blue`. Or a .rsp file, for polynomials, and for linear sensors without a black level. Throws
// std::invalid_argument for what the kind of file cannot hold, a curve that is not sound
// (response.h) or another ending, std::runtime_error if it cannot be written.
void write_response(const std::string& path, const CameraResponse& response);

}  // namespace capture
