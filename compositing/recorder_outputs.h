// What a take writes to: a video, fill and key as a pair of videos, a folder of EXR frames.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compositing/recorder.h"
#include "compositing/video_writer.h"

namespace compositing {

// Of the take's files: the programme's, and those of fill and key.
VideoSettings video_settings(const RecorderSettings& settings);
VideoSettings fill_settings(const RecorderSettings& settings);
VideoSettings key_settings(const RecorderSettings& settings);

// Used by one thread. Whatever throws has failed: then only give_up() makes sense.
class TakeOutput {
 public:
  virtual ~TakeOutput() = default;

  // Adds the frame that is the take's picture `index`; those ascend. Throws std::runtime_error with
  // path and reason if it cannot be written.
  virtual void write(std::int64_t index, const RecordedFrame& frame) = 0;
  // Interleaved samples from `first` on. Throws like write.
  virtual void write_sound(std::int64_t /*first*/, std::span<const float> /*samples*/) {}
  // Finishes it. Throws like write.
  virtual void close() {}
  // After a failure: finishes what is whole.
  virtual void give_up() noexcept {}

  // Frames that it has; of what was written last, only once it is finished.
  virtual std::int64_t pictures() const = 0;
  // Of fill and key: the share of all pixels whose key is above the matte.
  virtual std::optional<double> raised_share() const { return std::nullopt; }
};

// An output, and its name: a file's, "FILL and KEY", or the folder's.
struct NamedOutput {
  std::string name;
  std::unique_ptr<TakeOutput> output;
};

// All that the settings name. Throws like Recorder.
std::vector<NamedOutput> open_outputs(const RecorderSettings& settings);

}  // namespace compositing
