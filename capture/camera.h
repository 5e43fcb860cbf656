// Cameras behind one interface, opened by URI.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "capture/colour.h"
#include "capture/frame.h"

namespace capture {

struct CameraInfo {
  int width = 0;
  int height = 0;
  int whole_width = 0;  // of the source's picture, before options.crop; 0 = there is none other
  int whole_height = 0;
  Rational pixel_aspect{1, 1};  // a pixel's width over its height, as it is to be shown
  Rational rate;                // 0/1 = unknown or not constant (stills)
  Time jitter{};                // by how much frames may come later than the rate says
  std::int64_t frames = 0;  // about, where only length and rate are told; 0 = unknown or endless
  std::string description;  // for people: codec, format, colour tags and how they were read
  std::string doubt;        // why its frames may not be what they should; "" = no reason
  int sound_channels = 0;   // 0 = silent
  int sound_rate = 0;       // samples per second
  bool live = false;        // frames come as time goes by, on the monotonic clock
};

// Sound that goes with a stretch of frames: interleaved floats, -1 to 1.
struct Sound {
  Time time{};  // of the first sample, on the frames' clock
  int channels = 0;
  int rate = 0;
  std::vector<float> samples;
};

struct CameraStatistics {
  std::int64_t delivered = 0;  // all frames that next() gave; the following are among them
  std::int64_t lost = 0;
  std::int64_t damaged = 0;
  std::string cut_short;  // of a file that has ended before it says that it does: how, in words
  // Of a camera that brackets (bracketed_camera.h):
  std::optional<int> exposure_lag;  // frames from a request to its effect, where it is known
  std::vector<double> exposures_s;  // that it is told in turn
  std::int64_t refused = 0;         // exposures asked for that it did not take
  std::string refusal;              // why, of the last one
  // Of exposures that follow the light (auto_exposures.h):
  bool too_bright = false;  // something saturates in the shortest possible exposure
  bool too_dark = false;    // the longest possible exposure is too short
};

struct CameraOptions {
  PlateColour colour;                      // how codes become scene-linear values
  std::optional<std::int64_t> frame;       // start at this one; the source's first is 0
  std::optional<std::array<int, 4>> crop;  // x, y, width, height in source pixels
  bool loop = false;                       // files start again at their end, time going on
  Rational picture_rate{25, 1};            // of sequences, and of stills that loop
  std::string base_dir;                    // relative paths start here
  std::string response;                    // .rsp or .toml file (camera_response.h); "" = by colour
  // Bayer pictures: colours that were interpolated near saturated sites, and so are darker than the
  // light was, are no values (NaN). For brackets.
  bool mark_saturated = false;
  // Pictures of files that have alpha come with four channels: scene-linear, premultiplied, alpha 0
  // to 1; else without it.
  bool alpha = false;
  // Videos: every picture is deinterlaced, or none; nothing = those that are marked as interlaced.
  std::optional<bool> deinterlace;
  bool keep_coded = false;  // live cameras' frames keep the bytes that came
};

// Exposure times that a camera can be set to.
struct ExposureRange {
  double shortest_s = 0;
  double longest_s = 0;
};

// A source of frames. Not thread-safe: one thread reads it.
class Camera {
 public:
  virtual ~Camera() = default;
  virtual const CameraInfo& info() const = 0;
  // The next frame in order; nothing at the end. A frame that cannot be decoded comes with status
  // `lost`, and the previous image. Never throws for damage inside a stream once it is open.
  virtual std::optional<Frame> next() = 0;
  // Passes over that frame, for which a file's picture need not be made; false at the end. A lost
  // frame later may then come with an image of before it, or none, and what is wrong with a picture
  // that was not made counts nowhere.
  virtual bool skip() { return next().has_value(); }
  // The sound up to and including `until`, or the last frame's time if that is earlier, that was
  // not taken yet; after the end, up to where the next frame would have been. What is 10 s older
  // than the frame before the last one is dropped.
  virtual std::optional<Sound> take_sound(Time /*until*/ = Time::max()) { return std::nullopt; }
  virtual CameraStatistics statistics() const = 0;

  // Nothing if the exposure cannot be set from frame to frame.
  virtual std::optional<ExposureRange> exposure_range() const { return std::nullopt; }
  // Asks for an exposure, which some later frame is the first to have. From the first call on,
  // Frame::exposure_s is told only where the camera tells it with the frame itself. Returns what
  // the device took, rounded as it rounds. Throws std::runtime_error naming the device, what was
  // asked and what is possible, also while it is away.
  virtual double set_exposure(double exposure_s);
};

// Opens `file:PATH` (video, a still, a sequence with %0Nd), `replay:DIR`, `v4l2:DEVICE` or
// `aravis:NAME` (see cameras.md), or a scheme that a later folder registered (`made:`). A bare path
// counts as `file:`. Throws std::runtime_error naming the URI, the reason, and what to do.
std::unique_ptr<Camera> open_camera(std::string_view uri, const CameraOptions& options = {});

// Whether the URI names a device (`v4l2:`, `aravis:`), whose pictures come as time goes by.
bool is_device(std::string_view uri);

// Whether it begins with the scheme of a camera that there is; else it may be a path, which may
// have a colon in it.
bool has_scheme(std::string_view uri);

// Of numbered picture files: which numbers between the first and the last are missing, as "7, 12
// to 15"; those frames are lost. "" of all else, and of what cannot be opened.
std::string missing_pictures(std::string_view uri, const CameraOptions& options = {});

// What can be told from a URI alone, without opening anything: throws std::runtime_error, without
// the URI, with the reason and what to write, if its scheme is none that there is, or if it names a
// device with settings that none could have (see parse_v4l2 and parse_aravis) or with a pixel
// format that is not read. What else is wrong is found by open_camera.
void check_camera_uri(std::string_view uri);

using CameraOpener =
    std::function<std::unique_ptr<Camera>(std::string_view rest, const CameraOptions&)>;
// Adds a scheme ("made"). Call at start-up, before threads.
void register_camera(std::string scheme, CameraOpener opener);

}  // namespace capture
