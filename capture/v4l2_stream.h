// One open V4L2 device that delivers pictures, from its opening to its first failure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/coded_picture.h"
#include "capture/v4l2_device.h"
#include "capture/v4l2_request.h"

namespace capture {

// A filled buffer. Its bytes stay good until the next call of V4l2Stream::next.
struct V4l2Buffer {
  std::span<const std::byte> bytes;
  std::uint32_t sequence = 0;
  Time stamp{};
  bool stamped = false;        // by the monotonic clock
  bool at_start = false;       // of the exposure; else at the picture's end
  bool marked_faulty = false;  // by the driver: its content is damaged
};

class V4l2Stream {
 public:
  // Opens the device at `path`, sets what was asked for and chosen, and starts it. Throws
  // std::runtime_error, without the device's name, with what was asked and what is possible.
  V4l2Stream(std::shared_ptr<V4l2Io> io, const std::string& path, const V4l2Request& request);
  ~V4l2Stream();
  V4l2Stream(const V4l2Stream&) = delete;
  V4l2Stream& operator=(const V4l2Stream&) = delete;

  const V4l2Device& device() const { return device_; }
  const CodedLayout& layout() const { return layout_; }
  // Whether pictures hold two fields, of two moments.
  bool interlaced() const { return interlaced_; }
  Rational rate() const { return rate_; }  // 0/1 = not told
  // What it is set to; 0 = automatic, not told, or changing.
  double exposure_s() const { return exposure_s_; }
  // Sets another one while pictures come, which some later one is the first to have; from then on
  // exposure_s() is 0. Returns what the device took. Throws std::runtime_error, without the
  // device's name.
  double set_exposure(double exposure_s);

  // The next buffer in order; nothing if none came in time. Throws std::runtime_error, without the
  // device's name, when the stream has failed: make another one.
  std::optional<V4l2Buffer> next(Time longest);

 private:
  struct Mapping;

  void set_format(const V4l2Choice& choice);
  void set_rate(const V4l2Choice& choice, const V4l2Request& request);
  std::string name_of_control(std::uint32_t id) const;
  std::int64_t set_control(const std::string& name, std::int64_t value);
  void start();
  void give_back();

  V4l2Node node_;
  V4l2Device device_;
  CodedLayout layout_;
  bool interlaced_ = false;
  Rational rate_;
  double exposure_s_ = 0;
  bool exposure_is_ours_ = false;
  std::vector<std::unique_ptr<Mapping>> mappings_;
  std::optional<std::uint32_t> held_;  // the buffer that was lent last
  bool gave_up_ = false;  // the last buffer was faulty and empty, as of drivers that give all back
  bool streaming_ = false;
};

}  // namespace capture
