// A video that runs with the show: its newest picture at the show's time, and its last for ever.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/colour.h"
#include "studio/source.h"

namespace studio {

struct VideoSource {
  std::string uri;
  std::string base_dir;  // of relative paths in it
  bool loop = false;
  std::int64_t first = 0;  // frame that it begins with
  capture::Transfer colour = capture::Transfer::rec1886;
  bool alpha = false;                        // as capture::CameraOptions
  std::string response{};                    // the same, in place of `colour`
  std::optional<std::array<int, 4>> crop{};  // the same
  std::optional<bool> deinterlace{};         // the same
  friend bool operator==(const VideoSource&, const VideoSource&) = default;
};

// How its codes become light, for people and files: the curve's name, or capture::by_response.
std::string name_of_light(const VideoSource& source);

// Opens it. Throws as capture::open_camera.
std::unique_ptr<capture::Camera> open_video(const VideoSource& source);

// What to add to why a source cannot be opened while it is open as `held` by `holder`, as people
// call it: devices may be opened only once.
std::string words_for_held(const VideoSource& held,
                           const VideoSource& asked,
                           const std::string& holder);

// One thread uses it.
class TimedSource {
 public:
  // A file's first frame is due at `start` of the show's time, or, without one, at the next time
  // that is asked for. `live`: the show's time is the monotonic clock. Throws std::runtime_error,
  // std::invalid_argument if the source cannot be opened.
  TimedSource(const VideoSource& source, std::optional<capture::Time> start, bool live);

  // The newest frame whose time is not after the show's and `offset`, by which the source's frames
  // are stamped later. Times must not fall. Nothing where the last one holds, because there is no
  // newer one.
  std::optional<capture::Frame> at(capture::Time time, capture::Time offset = {});
  // The newest one with a picture that at() gave; before that, the source's first.
  const capture::Frame& newest() const { return pictured_ ? *pictured_ : source_.first(); }
  const capture::Frame& first() const { return source_.first(); }
  // How old its newest picture was at the time that was asked for last; 0 for stills, and before a
  // file begins. Below 0 of a live source that is ahead (Source).
  capture::Time age() const { return age_; }
  const capture::CameraInfo& info() const { return source_.info(); }

  // What to tell, after its name: each time that it stops giving frames, and once that it is not
  // whole.
  std::vector<std::string> take_notes();

 private:
  Source source_;
  std::optional<capture::Time> start_;
  bool live_;
  std::optional<capture::Frame> pictured_;  // the newest that was not lost
  capture::Time age_{};
  bool holds_ = false;  // its last frame, for it stalls or has ended
  bool told_cut_short_ = false;
  std::vector<std::string> notes_;
};

}  // namespace studio
