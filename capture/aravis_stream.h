// One open GigE Vision or USB3 Vision camera, from its opening to its first failure.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/aravis_device.h"
#include "capture/aravis_request.h"
#include "capture/coded_picture.h"
#include "capture/genicam_format.h"

struct _ArvBuffer;
struct _ArvChunkParser;
struct _ArvStream;

namespace capture {

// A picture as it came. Its bytes stay good until the next call of AravisStream::next.
struct AravisBuffer {
  std::span<const std::byte> bytes;  // as AravisStream::layout() says; empty = there is none
  std::string fault;                 // what is wrong with it, or ""
  std::uint64_t id = 0;              // as the camera counts; not told by all that are faulty
  std::optional<Time> stamp;         // on the camera's clock
  Time arrival{};                    // of its first packet, on the monotonic clock
  double exposure_s = 0;             // 0 = not told
};

// Opening and closing may take seconds where a camera does not answer.
class AravisStream {
 public:
  // Opens the camera, sets what was asked for, and starts it. Throws std::runtime_error, without
  // the camera's name, with what was asked and what is possible.
  AravisStream(const AravisDevice& device, const AravisRequest& request);
  ~AravisStream();
  AravisStream(const AravisStream&) = delete;
  AravisStream& operator=(const AravisStream&) = delete;

  const AravisDevice& device() const { return device_; }  // as the camera itself tells it
  const CodedLayout& layout() const { return layout_; }
  const std::string& format_name() const { return format_name_; }
  std::array<int, 4> region() const { return region_; }
  Rational rate() const { return rate_; }  // 0/1 = not told
  // Whether frame numbers are 16 bits that go from 65535 to 1.
  bool counts_in_16_bits() const { return is_gige_; }
  // Why packets of other senders are not kept out (see gvsp_filter.h), or "".
  const std::string& unguarded() const { return unguarded_; }
  bool tells_exposures() const { return chunk_parser_ != nullptr; }
  std::optional<ExposureRange> exposure_range() const { return exposures_; }
  // What it was opened with; 0 = automatic, not told, or changed by set_exposure since.
  double fixed_exposure_s() const { return fixed_exposure_s_; }
  // Sets the exposure of some later frame on. From the first call on, AravisBuffer::exposure_s is
  // told by chunks only. Returns what the camera took. Throws std::runtime_error, without the
  // camera's name, with what was asked and what is possible.
  double set_exposure(double exposure_s);

  // The next picture in order; nothing if none came in time. Throws std::runtime_error, without the
  // camera's name, when control of the camera is lost: make another stream.
  std::optional<AravisBuffer> next(Time longest);

 private:
  void identify();
  void set_all(const AravisRequest& request);
  void set_format(const std::optional<std::string>& wanted);
  void set_region(const AravisRequest& request);
  void set_rate(const std::optional<Rational>& wanted);
  void set_gain(double gain);
  void set_packets(const AravisRequest& request);
  void set_chunks(bool wanted);
  double write_exposure(double exposure_s);
  void start(const AravisRequest& request);
  void guard();
  void give_back();
  AravisBuffer read(_ArvBuffer& buffer);
  std::span<const std::byte> picture_in(_ArvBuffer& buffer, std::string& fault);
  double exposure_of(_ArvBuffer& buffer) const;

  AravisDevice device_;
  AravisHandle camera_;
  bool is_gige_ = false;
  std::string unguarded_;
  std::string format_name_;
  GenicamFormat format_;
  std::array<int, 4> region_{};
  CodedLayout layout_;
  Rational rate_;
  std::optional<ExposureRange> exposures_;
  double fixed_exposure_s_ = 0;  // 0 = automatic, or ours to set
  bool exposure_is_ours_ = false;
  std::size_t payload_bytes_ = 0;
  _ArvChunkParser* chunk_parser_ = nullptr;
  _ArvStream* stream_ = nullptr;
  _ArvBuffer* held_ = nullptr;  // that was lent last
  std::vector<std::byte> unpacked_;
  unsigned long lost_handler_ = 0;
  std::atomic<bool> control_lost_{false};
};

}  // namespace capture
