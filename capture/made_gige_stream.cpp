// Pictures of a made GigE Vision camera.
#include "capture/made_gige_stream.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "capture/counter_random.h"
#include "capture/v4l2_format.h"

namespace capture::gige {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kept_frames = 4;                   // to be sent again
constexpr std::uint64_t first_tick = 1'000'000'000'000;  // the device's clock is not the machine's
constexpr auto least_pause = 200us;                      // shorter ones are not worth sleeping
constexpr std::uint16_t last_block = 65535;

// One value of each pixel in the region, or three.
std::vector<std::uint16_t> codes_of(const MadeShot& shot,
                                    const Region& region,
                                    const GenicamFormat& format) {
  std::vector<std::uint16_t> codes;
  codes.reserve(static_cast<std::size_t>(region.width) * static_cast<std::size_t>(region.height) *
                static_cast<std::size_t>(format.channels));
  const PixelCoding* coding = coding_of(format.fourcc);
  const BayerPattern pattern = coding == nullptr ? BayerPattern::none : coding->raw.pattern;
  const int shift = shot.bits - format.bits;
  const auto add = [&](int code) {
    codes.push_back(static_cast<std::uint16_t>(shift >= 0 ? code >> shift : code << -shift));
  };
  const auto channels = static_cast<std::size_t>(shot.channels);
  const bool blue_first = format.name == "BGR8";
  for (int y = region.y; y < region.y + region.height; ++y) {
    const std::uint16_t* pixel =
        shot.codes.data() + (static_cast<std::size_t>(y) * static_cast<std::size_t>(shot.width) +
                             static_cast<std::size_t>(region.x)) *
                                channels;
    for (int x = region.x; x < region.x + region.width; ++x, pixel += channels) {
      if (format.channels == 3) {
        for (std::size_t c = 0; c < 3; ++c)
          add(pixel[channels == 3 ? (blue_first ? 2 - c : c) : 0]);
      } else if (channels == 1) {
        add(pixel[0]);
      } else {
        // The pattern is that of the picture that is sent.
        add(pixel[pattern == BayerPattern::none
                      ? 1
                      : colour_of_site(pattern, y - region.y, x - region.x)]);
      }
    }
  }
  return codes;
}

void check_shot(const MadeShot& shot, const MadeGigeSettings& settings) {
  const std::size_t values = static_cast<std::size_t>(settings.width) *
                             static_cast<std::size_t>(settings.height) *
                             static_cast<std::size_t>(shot.channels);
  if (shot.width != settings.width || shot.height != settings.height ||
      (shot.channels != 1 && shot.channels != 3) || shot.bits < 1 || shot.bits > 16 ||
      shot.codes.size() != values) {
    throw std::invalid_argument("a made GigE camera was given a picture that is not its sensor's");
  }
}

void add64(Bytes& to, std::uint64_t value) {
  to.resize(to.size() + 8);
  put64(to.data() + to.size() - 8, value);
}

void add_trailer(Bytes& to, std::uint32_t id, std::size_t size) {
  add64(to, std::uint64_t{id} << 32U | static_cast<std::uint32_t>(size));
}

}  // namespace

MadeStream::MadeStream(const MadeGigeSettings& settings, MadeGigePicture picture)
    : settings_(settings), picture_(std::move(picture)) {}

void MadeStream::start(std::uint32_t address) {
  if (!socket_.open({address, 0}, false)) {
    throw std::runtime_error("a made GigE camera cannot send from " + text_of_address(address));
  }
  stopping_ = false;
  plan_ = {};
  number_ = 0;
  sent_.clear();
  thread_ = std::thread([this] { run(); });
}

void MadeStream::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  socket_.close();
}

void MadeStream::follow(const MadeRegisters& registers) {
  Plan plan;
  plan.running = registers.running();
  plan.to = {registers.value(at::stream_address),
             static_cast<std::uint16_t>(registers.value(at::stream_port) & 0xffffU)};
  plan.packet_bytes = registers.value(at::stream_packet_size) & 0xffffU;
  plan.region = registers.region();
  plan.format = registers.format();
  plan.has_chunks = settings_.has_chunks && registers.value(feature::chunk_mode) != 0;
  for (std::uint32_t i = 0; i < made_chunks; ++i) plan.chunks[i] = registers.has_chunk(i);
  plan.exposure_s = registers.exposure_s();
  plan.rate = registers.real(feature::frame_rate);
  plan.gain = std::pow(10, registers.real(feature::gain_db) / 20);
  {
    const std::lock_guard lock(mutex_);
    plan_ = plan;
  }
  changed_.notify_all();
}

void MadeStream::send_test_packet(const MadeRegisters& registers, std::size_t packet_bytes) {
  constexpr std::size_t ip_and_udp = 28;
  const Bytes packet(std::max(packet_bytes, ip_and_udp) - ip_and_udp);
  socket_.send({registers.value(at::stream_address),
                static_cast<std::uint16_t>(registers.value(at::stream_port) & 0xffffU)},
               packet);
}

void MadeStream::resend(std::uint16_t block, std::uint32_t first, std::uint32_t last) {
  std::shared_ptr<const Sent> found;
  {
    const std::lock_guard lock(mutex_);
    const auto sent = std::ranges::find(sent_, block, [](const auto& one) { return one->block; });
    if (sent != sent_.end()) found = *sent;
  }
  if (found) send(*found, first, last, true);
}

void MadeStream::drop_next(int frames) {
  const std::lock_guard lock(mutex_);
  to_drop_ += frames;
}

void MadeStream::set_packet_loss(double share) {
  const std::lock_guard lock(mutex_);
  settings_.packet_loss = share;
}

void MadeStream::set_exposure_lag(int frames) {
  const std::lock_guard lock(mutex_);
  settings_.exposure_lag = frames;
}

MadeGigeCounts MadeStream::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

// Returns whether the stream still runs then.
bool MadeStream::wait_until(std::unique_lock<std::mutex>& lock, Clock::time_point time) {
  changed_.wait_until(lock, time, [this] { return stopping_ || !plan_.running; });
  return !stopping_ && plan_.running;
}

double MadeStream::exposure_of_next(double set_s) {
  set_exposures_.push_back(set_s);
  while (set_exposures_.size() > static_cast<std::size_t>(settings_.exposure_lag) + 1) {
    set_exposures_.pop_front();
  }
  return set_exposures_.front();
}

bool MadeStream::chance(double share) {
  return share > 0 && uniform_high(mixed_bits(settings_.seed, chances_++)) < share;
}

std::uint64_t MadeStream::ticks_of(Clock::time_point time) const {
  const auto since = static_cast<double>(time.time_since_epoch().count()) * settings_.clock_rate;
  return first_tick + static_cast<std::uint64_t>(since);
}

void MadeStream::run() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    changed_.wait(lock, [this] { return stopping_ || plan_.running; });
    std::uint16_t block = settings_.first_block;
    std::shared_ptr<const Sent> before;
    set_exposures_.clear();
    Clock::time_point start = Clock::now();
    while (wait_until(lock, start)) {
      const Plan plan = plan_;
      const double exposure_s = exposure_of_next(plan.exposure_s);
      const bool dropped = to_drop_ > 0 || chance(settings_.drop_share);
      if (to_drop_ > 0) --to_drop_;
      const bool repeated = before && chance(settings_.repeat_share);
      std::string fault;
      auto sent = std::make_shared<Sent>();
      sent->block = block;
      sent->leader.ticks = ticks_of(start);
      lock.unlock();
      if (repeated) {
        sent->leader = before->leader;
        sent->payload = before->payload;
      } else if (!dropped) {
        fault = make_payload(plan, exposure_s, *sent);
      }
      lock.lock();
      if (!fault.empty()) counts_.fault = fault;
      ++number_;
      counts_.exposed += 1;
      counts_.dropped += dropped || !fault.empty() ? 1 : 0;
      counts_.repeated += repeated ? 1 : 0;
      const auto exposure =
          std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(exposure_s));
      if (!wait_until(lock, start + exposure)) break;
      sent->to = plan.to;
      sent->packet_bytes = plan.packet_bytes;
      if (!dropped && fault.empty()) {
        sent_.push_back(sent);
        if (sent_.size() > kept_frames) sent_.pop_front();
        before = sent;
        lock.unlock();
        send(*sent, 0, ~0U, false);
        lock.lock();
      }
      block = block == last_block ? std::uint16_t{1} : static_cast<std::uint16_t>(block + 1);
      const auto period =
          std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / plan.rate));
      // A picture that takes longer than a frame to make slows the camera.
      start = std::max(start + std::max(period, exposure), Clock::now() - period);
    }
  }
}

// Returns why there is no picture, or "".
std::string MadeStream::make_payload(const Plan& plan, double exposure_s, Sent& sent) {
  MadeShot shot;
  try {
    shot = picture_({number_, exposure_s, plan.gain});
    check_shot(shot, settings_);
  } catch (const std::exception& error) {
    return error.what();
  }
  pack_genicam(plan.format, codes_of(shot, plan.region, plan.format), sent.payload);
  sent.leader.pixel_format = plan.format.code;
  sent.leader.width = static_cast<std::uint32_t>(plan.region.width);
  sent.leader.height = static_cast<std::uint32_t>(plan.region.height);
  sent.leader.x = static_cast<std::uint32_t>(plan.region.x);
  sent.leader.y = static_cast<std::uint32_t>(plan.region.y);
  sent.leader.has_chunks = plan.has_chunks;
  if (plan.has_chunks) add_chunks(plan, exposure_s, sent);
  return {};
}

void MadeStream::add_chunks(const Plan& plan, double exposure_s, Sent& sent) const {
  add_trailer(sent.payload, image_chunk_id, sent.payload.size());
  const std::array<std::uint64_t, made_chunks> values{
      std::bit_cast<std::uint64_t>(exposure_s * 1e6), sent.leader.ticks, sent.block};
  for (std::uint32_t i = 0; i < made_chunks; ++i) {
    if (!plan.chunks[i]) continue;
    add64(sent.payload, values[i]);
    add_trailer(sent.payload, chunk_id(i), 8);
  }
}

void MadeStream::send(const Sent& sent, std::uint32_t first, std::uint32_t last, bool again) {
  const PacketCutter cutter(sent.block, sent.leader, sent.payload, sent.packet_bytes);
  const Clock::time_point begin = Clock::now();
  double bits = 0;
  Bytes packet;
  for (std::uint32_t i = first; i < cutter.count() && i <= last; ++i) {
    bool lost = false;
    {
      const std::lock_guard lock(mutex_);
      lost = chance(settings_.packet_loss);
      counts_.packets += 1;
      counts_.lost_packets += lost ? 1 : 0;
      counts_.resent_packets += again ? 1 : 0;
    }
    if (lost) continue;
    cutter.cut(i, packet);
    socket_.send(sent.to, packet);
    // No faster than the link.
    bits += 8 * static_cast<double>(packet.size());
    const auto due = begin + std::chrono::duration_cast<Clock::duration>(
                                 std::chrono::duration<double>(bits / settings_.link_bits_per_s));
    if (due - Clock::now() > least_pause) std::this_thread::sleep_until(due);
  }
}

}  // namespace capture::gige
