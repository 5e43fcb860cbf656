// Two Matroska files whose pictures stay locked to each other: as many, with the same times.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>

#include "compositing/video_writer.h"

namespace compositing {

// Writes on the calling thread. Both files are made whole up to the same picture twice a second, to
// which they can go back. A killed writer leaves them at most that much apart.
class LockedVideos {
 public:
  // Sound is the first one's. Throws like VideoWriter; std::invalid_argument if both are one file,
  // or differ in rate or timecode.
  LockedVideos(const VideoSettings& first, const VideoSettings& second);

  // Adds picture `index` to both, see VideoWriter::write_picture. After a failure only salvage()
  // makes sense.
  void write_pictures(std::int64_t index,
                      std::span<const std::uint8_t> first,
                      std::span<const std::uint8_t> second);
  void write_sound(std::int64_t first, std::span<const float> samples);

  // Finishes both, if they have pictures. Throws std::runtime_error like VideoWriter::close, once
  // both are whole if it is an index that cannot be written.
  void close();

  // As VideoWriter::pictures(), of both.
  std::int64_t pictures() const { return std::min(first_.pictures(), second_.pictures()); }

  // After a failure, here or elsewhere: finishes both with the same pictures, as many as are whole
  // in both.
  void salvage() noexcept;

 private:
  void checkpoint();

  std::int64_t pictures_between_;           // from checkpoint to checkpoint
  std::optional<std::int64_t> checkpoint_;  // picture of the last one
  bool broken_ = false;                     // one may have a picture that the other has not
  VideoWriter first_;
  VideoWriter second_;
};

}  // namespace compositing
