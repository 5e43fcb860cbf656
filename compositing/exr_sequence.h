// A take as a folder of OpenEXR files: half R, G, B, A and matte, one file per frame.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "capture/frame.h"
#include "capture/image.h"
#include "compositing/output_file.h"
#include "compositing/timecode.h"

namespace compositing {

struct ExrSequenceSettings {
  std::string dir;  // made if missing; frames of the same number are replaced
  capture::Rational rate;
  std::string compression = "none";  // or "rle", "zip", "piz": smaller and slower in this order
  capture::Rational pixel_aspect{1, 1};
};

class ExrSequence {
 public:
  // Keeps others from the folder as long as it lives. Throws std::invalid_argument for an unknown
  // compression, std::runtime_error with path and reason if the folder cannot be made or written,
  // or another program writes it.
  explicit ExrSequence(const ExrSequenceSettings& settings);

  // Writes frame.NNNNNN.exr: rgba (height, width, 4), matte (height, width, 1), bits as they are,
  // with the timecode where the rate leaves it room (up to 40 per second; 48, 50 and 60 in pairs).
  // A file has its name only once it is whole. Throws std::invalid_argument if the images do not
  // fit together, std::runtime_error with path and reason if the file cannot be written.
  void write(std::int64_t number,
             const capture::HalfImage& rgba,
             const capture::HalfImage& matte,
             const std::optional<Timecode>& timecode) const;

  std::string path_of(std::int64_t number) const;
  // Of all frames in a folder, as a camera's URI has it: "DIR/frame.%06d.exr".
  static std::string pattern_in(const std::string& folder);

  // Frames, by their names, that are in a folder: of an earlier take, before the first is written.
  static std::int64_t frames_in(const std::string& folder);

 private:
  ExrSequenceSettings settings_;
  std::optional<FolderLock> lock_;  // nothing until the folder is there
};

}  // namespace compositing
