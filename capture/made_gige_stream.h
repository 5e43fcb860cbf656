// The pictures of a made GigE Vision camera: exposed in time, cut into packets, sent.
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "capture/gige_wire.h"
#include "capture/made_gige.h"
#include "capture/made_gige_registers.h"
#include "capture/made_gige_socket.h"

namespace capture::gige {

class MadeStream {
 public:
  MadeStream(const MadeGigeSettings& settings, MadeGigePicture picture);
  ~MadeStream() { stop(); }
  MadeStream(const MadeStream&) = delete;
  MadeStream& operator=(const MadeStream&) = delete;

  // Throws std::runtime_error if there is no socket at this address.
  void start(std::uint32_t address);
  void stop();
  // Takes over what the registers say, from the next exposure on.
  void follow(const MadeRegisters& registers);
  void send_test_packet(const MadeRegisters& registers, std::size_t packet_bytes);
  // Packets of one of the last frames; of others nothing comes.
  void resend(std::uint16_t block, std::uint32_t first, std::uint32_t last);

  void drop_next(int frames);
  void set_packet_loss(double share);
  void set_exposure_lag(int frames);
  MadeGigeCounts counts() const;

 private:
  using Clock = std::chrono::steady_clock;

  // As the registers were.
  struct Plan {
    bool running = false;
    Endpoint to;
    std::size_t packet_bytes = 0;
    Region region;
    GenicamFormat format;
    bool has_chunks = false;
    std::array<bool, made_chunks> chunks{};
    double exposure_s = 0;
    double rate = 1;
    double gain = 1;
  };
  struct Sent {
    std::uint16_t block = 0;
    Leader leader;
    Endpoint to;
    std::size_t packet_bytes = 0;
    Bytes payload;
  };

  void run();
  bool wait_until(std::unique_lock<std::mutex>& lock, Clock::time_point time);
  double exposure_of_next(double set_s);
  std::string make_payload(const Plan& plan, double exposure_s, Sent& sent);
  void add_chunks(const Plan& plan, double exposure_s, Sent& sent) const;
  void send(const Sent& sent, std::uint32_t first, std::uint32_t last, bool again);
  bool chance(double share);
  std::uint64_t ticks_of(Clock::time_point time) const;

  MadeGigeSettings settings_;
  MadeGigePicture picture_;
  UdpSocket socket_;
  std::thread thread_;

  mutable std::mutex mutex_;  // of all below
  std::condition_variable changed_;
  bool stopping_ = false;
  Plan plan_;
  std::deque<double> set_exposures_;  // of the frames that are started; the lag back is the first
  std::deque<std::shared_ptr<const Sent>> sent_;  // the last ones, to be sent again
  int to_drop_ = 0;
  std::uint64_t chances_ = 0;
  MadeGigeCounts counts_;
  std::int64_t number_ = 0;  // of the next exposure
};

}  // namespace capture::gige
