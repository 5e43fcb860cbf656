// Packets that are not a GigE Vision camera's: what passes the filter, and a stream among them.
#include "capture/gvsp_filter.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <random>
#include <stdexcept>
#include <thread>

#include <netinet/in.h>
#include <sys/socket.h>

#include "capture/aravis_camera.h"
#include "capture/gige_wire.h"
#include "capture/made_gige.h"
#include "capture/made_gige_socket.h"
#include "tests/capture/gige_client.h"
#include "tests/capture/telling_shot.h"

namespace capture::gvsp_filter_test {
namespace {

using namespace std::chrono_literals;
using gige::Bytes;
using gige::Endpoint;
using gige::UdpSocket;

constexpr std::uint32_t here = 127U << 24U | 1U;
constexpr std::uint32_t camera = 127U << 24U | 77U << 16U | 5U;
constexpr std::uint32_t stranger = 127U << 24U | 77U << 16U | 6U;
constexpr std::size_t packet_bytes = 576;
constexpr std::size_t payload_bytes = 5000;
constexpr std::uint32_t packets = 10;            // of 540 bytes
constexpr std::uint32_t packets_with_long = 10;  // of 528 bytes

Endpoint bound(const UdpSocket& socket) {
  sockaddr_in address{};
  socklen_t size = sizeof(address);
  ::getsockname(socket.descriptor(), reinterpret_cast<sockaddr*>(&address), &size);
  return {ntohl(address.sin_addr.s_addr), ntohs(address.sin_port)};
}

enum class Ids { of_16_bits, of_64_bits };

// A packet's header; `content` is 1 for a leader, 2 a trailer, 3 data, 7 data of a part.
Bytes packet(unsigned content,
             std::uint32_t number,
             std::size_t body,
             Ids ids = Ids::of_16_bits,
             std::uint16_t block = 7) {
  Bytes bytes((ids == Ids::of_64_bits ? 20U : 8U) + body);
  if (ids == Ids::of_64_bits) {
    gige::put32(&bytes[4], (0x80U | content) << 24U);
    gige::put64(&bytes[8], block);
    gige::put32(&bytes[16], number);
  } else {
    gige::put16(&bytes[2], block);
    gige::put32(&bytes[4], content << 24U | number);
  }
  return bytes;
}

Bytes leader(unsigned type, Ids ids = Ids::of_16_bits, std::size_t body = 36) {
  Bytes bytes = packet(1, 0, body, ids);
  gige::put16(&bytes[bytes.size() - body + 2], static_cast<std::uint16_t>(type));
  return bytes;
}

class FilterGvsp : public testing::Test {
 protected:
  FilterGvsp() {
    EXPECT_TRUE(stream_.open({here, 0}, false));
    EXPECT_TRUE(camera_.open({camera, 0}, false));
    EXPECT_TRUE(stranger_.open({stranger, 0}, false));
  }

  void filter() { filter_gvsp(stream_.descriptor(), {camera, payload_bytes, packet_bytes}); }

  bool passes(const Bytes& bytes) { return passes(bytes, camera_); }

  // Whether it comes before what is sent after it, and does pass.
  bool passes(const Bytes& bytes, const UdpSocket& from) {
    const Bytes mark = packet(2, 1, 99);
    from.send(bound(stream_), bytes);
    camera_.send(bound(stream_), mark);
    bool came = false;
    while (true) {
      Bytes next;
      if (!stream_.receive(next)) {
        gige::wait_for_packets(stream_, {}, 10s);
        if (!stream_.receive(next)) {
          ADD_FAILURE() << "nothing comes";
          return false;
        }
      }
      if (next == mark) return came;
      EXPECT_EQ(next, bytes);
      came = true;
    }
  }

  UdpSocket stream_;
  UdpSocket camera_;
  UdpSocket stranger_;
};

TEST_F(FilterGvsp, PassesAllThatACameraSends) {
  filter();
  const Bytes payload(payload_bytes);
  for (const bool has_chunks : {false, true}) {
    gige::Leader leader;
    leader.has_chunks = has_chunks;
    const gige::PacketCutter cutter(1, leader, payload, packet_bytes);
    for (std::uint32_t i = 0; i < cutter.count(); ++i) {
      Bytes cut;
      cutter.cut(i, cut);
      EXPECT_TRUE(passes(cut)) << i;
      gige::put16(cut.data(), 0x0100);
      EXPECT_TRUE(passes(cut)) << i << " sent again";
    }
  }
  for (std::uint32_t i = 1; i <= packets_with_long; ++i) {
    EXPECT_TRUE(passes(packet(3, i, 528, Ids::of_64_bits))) << i;
  }
  EXPECT_TRUE(passes(leader(1, Ids::of_64_bits)));
  EXPECT_TRUE(passes(leader(0x4001, Ids::of_64_bits)));
  EXPECT_TRUE(passes(packet(2, packets_with_long + 1, 8, Ids::of_64_bits)));
  EXPECT_TRUE(passes(packet(2, 3, 8))) << "a picture that is smaller than its buffer";
  EXPECT_TRUE(passes(packet(3, 2, 2000))) << "what is too large is cut off by who reads it";
}

TEST_F(FilterGvsp, DropsWhatIsOfNoPicture) {
  filter();
  for (const Ids ids : {Ids::of_16_bits, Ids::of_64_bits}) {
    EXPECT_FALSE(passes(packet(3, 0, 100, ids))) << "data in place of the leader";
    EXPECT_FALSE(passes(packet(3, packets + 1, 100, ids))) << "data beyond the buffer";
    EXPECT_FALSE(passes(packet(3, 0xffffff, 100, ids)));
    EXPECT_FALSE(passes(packet(2, 0, 8, ids))) << "a picture of a trailer alone";
    EXPECT_FALSE(passes(packet(2, packets + 2, 8, ids)));
    EXPECT_FALSE(passes(packet(2, 0xffffff, 8, ids)));
    EXPECT_FALSE(passes(packet(1, 1, 36, ids))) << "a leader in the midst";
    EXPECT_FALSE(passes(leader(1, ids, 35))) << "a leader that is cut off";
    for (const unsigned type : {0U, 2U, 3U, 6U, 7U, 8U, 9U, 10U, 0x400aU, 0x3fffU}) {
      EXPECT_FALSE(passes(leader(type, ids))) << type;
    }
    for (const unsigned content : {0U, 4U, 5U, 6U, 7U, 8U, 0x7fU}) {
      EXPECT_FALSE(passes(packet(content, 1, 100, ids))) << content;
    }
  }
  EXPECT_FALSE(passes(packet(2, 0xffffffff, 8, Ids::of_64_bits)));
  EXPECT_FALSE(passes(packet(3, 0x80000001, 8, Ids::of_64_bits)));
}

TEST_F(FilterGvsp, DropsHeadersThatAreCutOff) {
  filter();
  for (const Ids ids : {Ids::of_16_bits, Ids::of_64_bits}) {
    for (const unsigned content : {1U, 2U, 3U}) {
      const Bytes whole = content == 1 ? packet(1, 0, 0, ids) : packet(content, 1, 0, ids);
      EXPECT_EQ(passes(whole), content != 1);
      for (std::size_t size = 0; size < whole.size(); ++size) {
        EXPECT_FALSE(passes({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)}))
            << content << " " << size;
      }
    }
  }
}

TEST_F(FilterGvsp, DropsWhatOthersSend) {
  EXPECT_TRUE(passes(packet(3, 1, 100), stranger_)) << "without a filter";
  filter();
  EXPECT_FALSE(passes(packet(3, 1, 100), stranger_));
  EXPECT_FALSE(passes(leader(1), stranger_));
}

TEST_F(FilterGvsp, TakesOutWhatWaits) {
  for (int i = 0; i < 100; ++i) stranger_.send(bound(stream_), packet(3, 0xffffff, 100));
  std::this_thread::sleep_for(10ms);
  filter();
  EXPECT_FALSE(passes(packet(3, 0xffffff, 100), stranger_)) << "nothing else comes either";
}

TEST_F(FilterGvsp, RefusesWhatIsNoCamera) {
  const int socket = stream_.descriptor();
  EXPECT_THROW(filter_gvsp(socket, {camera, payload_bytes, 127}), std::invalid_argument);
  EXPECT_THROW(filter_gvsp(socket, {camera, 0, packet_bytes}), std::invalid_argument);
  EXPECT_THROW(filter_gvsp(-1, {camera, payload_bytes, packet_bytes}), std::runtime_error);
}

TEST(UdpSocketAt, FindsTheOneThatIsBoundThere) {
  UdpSocket one;
  ASSERT_TRUE(one.open({here, 0}, false));
  const std::uint16_t port = bound(one).port;
  UdpSocket other;
  ASSERT_TRUE(other.open({stranger, port}, false));
  EXPECT_EQ(udp_socket_at(here, port), one.descriptor());
  EXPECT_EQ(udp_socket_at(stranger, port), other.descriptor());
  EXPECT_EQ(udp_socket_at(camera, port), std::nullopt);
}

// All UDP sockets of this process at `address`, which are a stream's and its camera's.
std::vector<Endpoint> sockets_at(std::uint32_t address) {
  std::vector<Endpoint> found;
  for (const auto& file : std::filesystem::directory_iterator("/proc/self/fd")) {
    const int descriptor = std::stoi(file.path().filename());
    sockaddr_in at{};
    socklen_t size = sizeof(at);
    if (::getsockname(descriptor, reinterpret_cast<sockaddr*>(&at), &size) != 0) continue;
    if (at.sin_family != AF_INET || ntohl(at.sin_addr.s_addr) != address) continue;
    if (at.sin_port != 0) found.push_back({address, ntohs(at.sin_port)});
  }
  return found;
}

// Sends packets of odd kinds to all sockets at 127.0.0.1 while it lives.
class Attacker {
 public:
  explicit Attacker(std::uint32_t address) {
    EXPECT_TRUE(socket_.open({address, 0}, false));
    thread_ = std::thread([this] { run(); });
  }
  ~Attacker() {
    stopping_ = true;
    thread_.join();
  }
  int sent() const { return sent_; }

 private:
  void run() {
    const auto one_of = [this](auto... values) {
      const std::array all{static_cast<std::uint32_t>(values)...};
      return all[random_() % all.size()];
    };
    while (!stopping_) {
      for (const Endpoint to : sockets_at(here)) {
        for (int i = 0; i < 20; ++i) {
          Bytes bytes = packet(one_of(1, 1, 2, 2, 3, 3, 4, 5, 7, 8),
                               one_of(0, 0, 1, 2, 3, 5, 6, 7, 8, 9, 100, 0xffffff),
                               one_of(0, 1, 8, 36, 60, 400, 1400),
                               one_of(0, 1) == 0 ? Ids::of_16_bits : Ids::of_64_bits,
                               static_cast<std::uint16_t>(random_() % 400));
          // Sizes of pictures and parts that take all memory, among others.
          for (std::size_t k = 20; k < bytes.size(); ++k) {
            bytes[k] = static_cast<std::uint8_t>(one_of(0, 0xff, random_() & 0xffU));
          }
          const std::size_t type = (bytes[4] & 0x80U) != 0 ? 22 : 10;
          if (bytes.size() > type + 2) {
            gige::put16(&bytes[type], static_cast<std::uint16_t>(one_of(1, 4, 5, 10, 0x4001, 2)));
          }
          if (one_of(0, 0, 0, 1) == 1) bytes.resize(random_() % 21);
          socket_.send(to, bytes);
          ++sent_;
        }
      }
      std::this_thread::sleep_for(1ms);
    }
  }

  UdpSocket socket_;
  std::mt19937_64 random_{5};
  std::atomic<bool> stopping_{false};
  std::atomic<int> sent_{0};
  std::thread thread_;
};

constexpr int width = 64;
constexpr int height = 32;

class StreamUnderAttack : public testing::Test {
 protected:
  static MadeGigeSettings settings() {
    MadeGigeSettings settings;
    settings.width = width;
    settings.height = height;
    settings.rate = 100;
    settings.exposure_s = 1e-3;
    settings.first_block = 1;
    settings.has_chunks = true;
    return settings;
  }

  // Reads frames until so many were good.
  static CameraStatistics read_good(Camera& camera, std::int64_t many) {
    const auto end = std::chrono::steady_clock::now() + 60s;
    std::int64_t good = 0;
    while (good < many && std::chrono::steady_clock::now() < end) {
      const auto frame = camera.next();
      if (frame && frame->status == FrameStatus::good) ++good;
    }
    EXPECT_EQ(good, many) << "frames go on";
    return camera.statistics();
  }

  MadeGigeCamera made_{
      settings(), [](const MadeGigeShot& shot) { return made::telling_shot(shot, width, height); }};
};

TEST_F(StreamUnderAttack, TakesNothingOfOtherSenders) {
  Attacker attacker(stranger);
  const auto camera = open_aravis(made_.address() + "?packet_size=576", {}, {});
  const CameraStatistics counts = read_good(*camera, 60);
  EXPECT_LT(counts.lost + counts.damaged, 60);
  EXPECT_GT(attacker.sent(), 1000);
  EXPECT_EQ(camera->info().description.find("not kept out"), std::string::npos);
}

// Pictures may be damaged by what passes; nothing may end.
TEST_F(StreamUnderAttack, OutlivesWhatAnotherSendsInItsCamerasName) {
  const auto camera = open_aravis(made_.address() + "?packet_size=576", {}, {});
  read_good(*camera, 5);
  {
    Attacker attacker(made::address_of(made_.address()));
    const auto end = std::chrono::steady_clock::now() + 1s;
    while (std::chrono::steady_clock::now() < end) camera->next();
    EXPECT_GT(attacker.sent(), 1000);
  }
  read_good(*camera, 5);
}

}  // namespace
}  // namespace capture::gvsp_filter_test
