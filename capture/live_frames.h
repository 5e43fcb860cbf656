// What every live camera does with its pictures: to light, numbered, in order, losses in between.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "capture/camera.h"
#include "capture/coded_picture.h"
#include "capture/crop.h"
#include "capture/pool.h"

namespace capture {

// Not thread-safe.
class LiveFrames {
 public:
  LiveFrames(LightCurves curves, bool keep_coded)
      : curves_(std::move(curves)), keep_coded_(keep_coded) {}

  // How pictures are laid out from now on; `crop` is the part of them that is shown. Throws
  // std::runtime_error, without the device's name.
  void set_layout(const CodedLayout& layout, const Crop& crop);
  const CodedLayout& layout() const { return layout_; }
  // How the last picture was read; "" before the first.
  std::string description() const { return reader_ ? reader_->description() : std::string(); }

  // Adds a frame that came. `fault` says what is wrong with it, or is empty. What holds no picture
  // is a lost frame.
  void add(std::span<const std::byte> bytes, const std::string& fault, Frame frame);
  // Adds a frame that did not come.
  void lose(Time time, const std::string& note);
  // Adds as many as a device counted and did not deliver, evenly between the last frame and `time`;
  // one, if there are more than 250.
  void lose_between(std::uint64_t missing, Time time, const std::string& note);

  bool has_picture() const { return last_image_ != nullptr; }
  // Of the frame that was added last.
  std::optional<Time> last_time() const { return last_time_; }
  const std::string& last_note() const { return last_note_; }
  // Forgets all frames but the last one, which gets the number 0.
  void begin();

  bool empty() const { return ready_.empty(); }
  // The next frame. There must be one.
  Frame take();
  CameraStatistics statistics() const { return statistics_; }

 private:
  void read(std::span<const std::byte> bytes, const std::string& fault, Frame& frame);
  void push(Frame frame);

  LightCurves curves_;
  bool keep_coded_;
  CodedLayout layout_;
  Crop crop_;
  std::optional<CodedPictureReader> reader_;
  Pool<Image> pool_;
  Pool<CodedPicture> coded_pool_;
  std::deque<Frame> ready_;
  std::shared_ptr<const Image> last_image_;
  std::optional<Time> last_time_;
  std::string last_note_;
  std::int64_t number_ = 0;
  CameraStatistics statistics_;
};

// "the camera left out 3 frames"
std::string words_of_missing(std::uint64_t missing);

}  // namespace capture
