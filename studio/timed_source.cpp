// Videos by the show's time.
#include "studio/timed_source.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "capture/exr.h"
#include "capture/live_reader.h"

namespace studio {
namespace {

using namespace std::chrono_literals;

// A live source without a new frame for so long stalls.
constexpr capture::Time patience = 1s;

}  // namespace

std::string name_of_light(const VideoSource& source) {
  return std::string(source.response.empty() ? capture::name_of(source.colour)
                                             : capture::by_response);
}

std::unique_ptr<capture::Camera> open_video(const VideoSource& source) {
  capture::CameraOptions options;
  options.colour.transfer = source.colour;
  options.loop = source.loop;
  options.base_dir = source.base_dir;
  options.alpha = source.alpha;
  options.response = source.response;
  options.crop = source.crop;
  options.deinterlace = source.deinterlace;
  if (source.first > 0) options.frame = source.first;
  return capture::open_camera(source.uri, options);
}

std::string words_for_held(const VideoSource& held,
                           const VideoSource& asked,
                           const std::string& holder) {
  std::string other;
  if (held.response != asked.response) {
    other += " with another response";
  } else if (held.colour != asked.colour) {
    other += fmt::format(" with colour = \"{}\", not \"{}\"", capture::name_of(held.colour),
                         capture::name_of(asked.colour));
  }
  if (held.crop != asked.crop) other += " with another crop";
  if (held.loop != asked.loop) other += " with another loop";
  if (held.first != asked.first) other += " with another frame";
  return fmt::format(
      ". {} holds it{}: what can be opened only once changes in two edits, one without it and one "
      "with it as it is to be, or by starting anew",
      holder, other);
}

TimedSource::TimedSource(const VideoSource& source, std::optional<capture::Time> start, bool live)
    : source_(open_video(source)), start_(start), live_(live) {}

std::optional<capture::Frame> TimedSource::at(capture::Time time, capture::Time offset) {
  capture::Time asked = time + offset;
  if (!source_.is_live()) {
    if (!start_) start_ = time;
    asked = source_.first().time + (time - *start_) + offset;
  } else if (!live_) {
    asked = capture::monotonic_now();
  }
  std::optional<capture::Frame> frame = source_.at(asked);
  const bool stalls = frame && source_.is_live() && asked - frame->time > patience;
  const bool lost = frame && frame->status == capture::FrameStatus::lost;
  const bool holds = !frame || stalls || lost;
  if (holds && !holds_) {
    std::string note = !frame ? "has ended" : lost ? "lost a frame" : "stalls";
    if (lost && !frame->note.empty()) note += " (" + frame->note + ")";
    notes_.push_back(note + ": its last picture stays");
  }
  holds_ = holds;
  if (!source_.is_live() && !told_cut_short_) {
    const std::string how = source_.statistics().cut_short;
    told_cut_short_ = !how.empty();
    if (told_cut_short_) notes_.push_back("is not whole: " + how);
  }
  if (frame && !lost) pictured_ = frame;
  // Asked for the first time, and after its end.
  if (!frame && !pictured_ && source_.current().image) pictured_ = source_.current();
  age_ = source_.is_still() || !pictured_ ? capture::Time{} : asked - pictured_->time;
  if (!source_.is_live()) age_ = std::max(age_, capture::Time{});
  return frame;
}

std::vector<std::string> TimedSource::take_notes() { return std::exchange(notes_, {}); }

}  // namespace studio
