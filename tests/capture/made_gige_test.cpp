// The made GigE Vision camera, packet by packet.
#include "capture/made_gige.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <mutex>
#include <stdexcept>
#include <thread>

#include "tests/capture/gige_client.h"
#include "tests/capture/telling_shot.h"

namespace capture::made_gige_test {
namespace {

using made::ClientFrame;
using made::GigeClient;
using testing::HasSubstr;
namespace at = gige::at;
namespace feature = gige::feature;
using gige::Status;

constexpr int width = 40;
constexpr int height = 20;

MadeShot telling_shot(const MadeGigeShot& shot) { return made::telling_shot(shot, width, height); }

MadeGigeSettings small() {
  MadeGigeSettings settings;
  settings.width = width;
  settings.height = height;
  settings.rate = 100;
  settings.formats = {"Mono12", "Mono8", "Mono12Packed", "Mono12p"};
  return settings;
}

int code(const ClientFrame& frame, std::size_t i) {
  const gige::Bytes payload = frame.payload();
  return payload.at(2 * i) | payload.at(2 * i + 1) << 8;
}

TEST(MadeGigeCamera, SendsEveryCode) {
  const MadeGigeCamera camera(small(), telling_shot);
  GigeClient client(camera.address());
  client.start();
  for (int i = 0; i < 5; ++i) {
    const auto frame = client.frame();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->width, 40U);
    EXPECT_EQ(frame->height, 20U);
    ASSERT_EQ(frame->payload().size(), 2U * width * height);
    const MadeShot truth = telling_shot({code(*frame, 0), 0.005, 1});
    for (std::size_t k = 0; k < truth.codes.size(); ++k) {
      ASSERT_EQ(code(*frame, k), truth.codes[k]) << k;
    }
  }
  EXPECT_EQ(camera.counts().fault, "");
}

TEST(MadeGigeCamera, CountsOverTheEndOfItsNumbers) {
  MadeGigeSettings settings = small();
  settings.first_block = 65533;
  const MadeGigeCamera camera(settings, telling_shot);
  GigeClient client(camera.address());
  client.start();
  for (const int block : {65533, 65534, 65535, 1, 2}) {
    const auto frame = client.frame();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->block, block);
  }
}

TEST(MadeGigeCamera, TakesAnExposureAfterItsLag) {
  for (const int lag : {0, 1, 3}) {
    MadeGigeSettings settings = small();
    settings.exposure_lag = lag;
    settings.exposures.longest_s = 0.01;
    const MadeGigeCamera camera(settings, telling_shot);
    GigeClient client(camera.address());
    client.start();
    ASSERT_TRUE(client.frame());
    // Written somewhere in frame n + 1; from n + 2 on the lag counts.
    const int before = code(*client.frame(), 0);
    ASSERT_EQ(client.write_real(feature::exposure_us, 8000), Status::success);
    std::optional<ClientFrame> frame;
    do {
      frame = client.frame();
      ASSERT_TRUE(frame);
    } while (code(*frame, 1) == 500);
    EXPECT_EQ(code(*frame, 1), 800);
    EXPECT_GE(code(*frame, 0), before + 1 + lag);
  }
}

TEST(MadeGigeCamera, RoundsExposuresIntoItsSteps) {
  MadeGigeSettings settings = small();
  settings.exposure_step_s = 1e-5;
  settings.exposures = {1e-4, 0.1};
  const MadeGigeCamera camera(settings, telling_shot);
  GigeClient client(camera.address());
  client.start();
  for (const auto& [asked, taken] : {std::pair{1234.0, 1230.0}, {1e9, 1e5}, {-5.0, 100.0}}) {
    EXPECT_EQ(client.write_real(feature::exposure_us, asked), Status::success);
    EXPECT_NEAR(client.real(feature::exposure_us), taken, 1e-6);
  }
  EXPECT_EQ(client.write_real(feature::exposure_us, std::nan("")), Status::invalid_parameter);
  EXPECT_NEAR(client.real(feature::exposure_us), 100, 1e-6);
}

TEST(MadeGigeCamera, TellsItsExposuresInChunks) {
  MadeGigeSettings settings = small();
  settings.has_chunks = true;
  const MadeGigeCamera camera(settings, telling_shot);
  GigeClient client(camera.address());
  ASSERT_EQ(client.write(at::control_privilege, 2), Status::success);
  ASSERT_EQ(client.write(feature::chunk_mode, 1), Status::success);
  ASSERT_EQ(client.write(feature::chunk_enable, 1), Status::success);
  const std::size_t image_bytes = 2U * width * height;
  EXPECT_EQ(client.value(feature::payload_size), image_bytes + 8 + 16);
  client.start();
  const auto frame = client.frame();
  ASSERT_TRUE(frame);
  EXPECT_TRUE(frame->has_chunks);
  const gige::Bytes payload = frame->payload();
  ASSERT_EQ(payload.size(), image_bytes + 24);
  EXPECT_EQ(gige::get32(&payload[image_bytes]), gige::image_chunk_id);
  EXPECT_EQ(gige::get32(&payload[image_bytes + 4]), image_bytes);
  EXPECT_NEAR(std::bit_cast<double>(gige::get64(&payload[image_bytes + 8])), 5000, 1e-6);
  EXPECT_EQ(gige::get32(&payload[image_bytes + 16]), gige::chunk_id(gige::exposure_chunk));
}

TEST(MadeGigeCamera, SendsAPartOfItsSensor) {
  const MadeGigeCamera camera(small(), telling_shot);
  GigeClient client(camera.address());
  ASSERT_EQ(client.write(at::control_privilege, 2), Status::success);
  for (const auto& [register_at, value] : {std::pair{feature::width, 8U},
                                           {feature::height, 4U},
                                           {feature::offset_x, 3U},
                                           {feature::offset_y, 2U}}) {
    ASSERT_EQ(client.write(register_at, value), Status::success);
  }
  EXPECT_EQ(client.write(feature::width, 41), Status::invalid_parameter);
  EXPECT_EQ(client.write(feature::width, 0), Status::invalid_parameter);
  client.start();
  const auto frame = client.frame();
  ASSERT_TRUE(frame);
  ASSERT_EQ(frame->payload().size(), 2U * 8 * 4);
  // The shot's number is not in this part: the pattern tells it.
  const int first = code(*frame, 0);
  const int number = (first + 4096 - (2 * width + 3) * 37 % 4096) % 4096;
  const MadeShot truth = telling_shot({number, 0.005, 1});
  for (std::size_t y = 0; y < 4; ++y) {
    for (std::size_t x = 0; x < 8; ++x) {
      EXPECT_EQ(code(*frame, y * 8 + x), truth.codes[(y + 2) * width + x + 3]);
    }
  }
  EXPECT_EQ(client.write(feature::width, 10), Status::access_denied) << "while it runs";
}

TEST(MadeGigeCamera, LosesAndRepeatsTheSharesThatAreSet) {
  MadeGigeSettings settings = small();
  settings.rate = 500;
  settings.exposure_s = 1e-4;
  settings.drop_share = 0.2;
  settings.repeat_share = 0.2;
  settings.packet_loss = 0.1;
  const MadeGigeCamera camera(settings, telling_shot);
  GigeClient client(camera.address());
  client.start();
  const auto end = std::chrono::steady_clock::now() + GigeClient::patience;
  while (camera.counts().exposed < 500 && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  const MadeGigeCounts counts = camera.counts();
  const auto share = [](std::int64_t part, std::int64_t all) {
    return static_cast<double>(part) / static_cast<double>(all);
  };
  // Five standard deviations of 500.
  EXPECT_NEAR(share(counts.dropped, counts.exposed), 0.2, 0.09);
  EXPECT_NEAR(share(counts.repeated, counts.exposed), 0.2, 0.09);
  EXPECT_NEAR(share(counts.lost_packets, counts.packets), 0.1, 0.07);
}

TEST(MadeGigeCamera, SendsPacketsAgain) {
  MadeGigeSettings settings = small();
  settings.rate = 2;
  const MadeGigeCamera camera(settings, telling_shot);
  GigeClient client(camera.address());
  client.start();
  const auto frame = client.frame();
  ASSERT_TRUE(frame);
  client.ask_again(frame->block, 1, 1);
  const auto again = client.packet();
  ASSERT_TRUE(again);
  EXPECT_EQ(gige::get16(again->data() + 2), frame->block);
  EXPECT_EQ(gige::Bytes(again->begin() + 8, again->end()), frame->packets.at(1));
  EXPECT_EQ(camera.counts().resent_packets, 1);
}

TEST(MadeGigeCamera, ObeysOneApplicationOnly) {
  MadeGigeSettings settings = small();
  const MadeGigeCamera camera(settings, telling_shot);
  GigeClient one(camera.address());
  GigeClient other(camera.address());
  EXPECT_EQ(one.write(feature::width, 8), Status::access_denied) << "without control";
  one.start();
  EXPECT_EQ(other.write(at::control_privilege, 2), Status::access_denied);
  EXPECT_EQ(other.write_real(feature::exposure_us, 100), Status::access_denied);
  EXPECT_EQ(other.value(feature::width), 40U) << "anyone may read";
  EXPECT_EQ(one.write(at::control_privilege, 0), Status::success);
  EXPECT_EQ(other.write(at::control_privilege, 2), Status::success);
}

TEST(MadeGigeCamera, StopsForAnApplicationThatIsSilent) {
  const MadeGigeCamera camera(small(), telling_shot);
  GigeClient client(camera.address());
  client.start();
  ASSERT_EQ(client.write(at::heartbeat_timeout_ms, 100), Status::success);
  GigeClient watcher(camera.address());
  const auto end = std::chrono::steady_clock::now() + GigeClient::patience;
  while (watcher.value(feature::acquisition) != 0 && std::chrono::steady_clock::now() < end) {
  }
  EXPECT_EQ(watcher.value(feature::acquisition), 0U);
}

TEST(MadeGigeCamera, RunsNextToOthers) {
  const MadeGigeCamera one(small(), telling_shot);
  const MadeGigeCamera other(small(), telling_shot);
  EXPECT_NE(one.address(), other.address());
  EXPECT_NE(one.serial(), other.serial());
  GigeClient of_one(one.address());
  GigeClient of_other(other.address());
  of_one.start();
  of_other.start();
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(of_one.frame());
    EXPECT_TRUE(of_other.frame());
  }
}

TEST(MadeGigeCamera, ForgetsItsSettingsWhenUnplugged) {
  MadeGigeCamera camera(small(), telling_shot);
  GigeClient client(camera.address());
  client.start();
  ASSERT_EQ(client.write_real(feature::exposure_us, 700), Status::success);
  camera.unplug();
  camera.unplug();
  camera.plug_in();
  camera.plug_in();
  EXPECT_NEAR(client.real(feature::exposure_us), 5000, 1e-9);
  EXPECT_EQ(client.value(at::control_privilege), 0U);
  client.start();
  EXPECT_TRUE(client.frame());
}

TEST(MadeGigeCamera, RefusesWhatIsNoCommand) {
  const MadeGigeCamera camera(small(), telling_shot);
  GigeClient client(camera.address());
  const auto status = [&](gige::CommandCode code, const gige::Bytes& data) {
    const auto answer = client.ask(code, data);
    return answer ? answer->first : Status::success;
  };
  EXPECT_EQ(status(gige::CommandCode{0x1234}, {}), Status::not_implemented);
  EXPECT_EQ(status(gige::CommandCode::read_register, {1, 2}), Status::invalid_parameter);
  EXPECT_EQ(status(gige::CommandCode::read_memory, {}), Status::invalid_parameter);
  EXPECT_EQ(status(gige::CommandCode::read_memory, {0xff, 0xff, 0xff, 0xff, 0, 0, 0, 4}),
            Status::invalid_address);
  ASSERT_EQ(client.write(at::control_privilege, 2), Status::success);
  EXPECT_EQ(client.write(at::mac_low, 1), Status::write_protect);
  EXPECT_EQ(client.write(0xfffffffc, 1), Status::invalid_address);
  EXPECT_EQ(client.write(feature::pixel_format, 77), Status::invalid_parameter);
  EXPECT_EQ(client.write(at::stream_packet_size, 8), Status::invalid_parameter);
}

TEST(MadeGigeCamera, CountsPicturesThatAreNotItsSensors) {
  const MadeGigeCamera camera(small(), [](const MadeGigeShot&) { return MadeShot{}; });
  GigeClient client(camera.address());
  client.start();
  const auto end = std::chrono::steady_clock::now() + GigeClient::patience;
  while (camera.counts().dropped < 2 && std::chrono::steady_clock::now() < end) {
  }
  EXPECT_THAT(camera.counts().fault, HasSubstr("not its sensor's"));
}

TEST(MadeGigeCamera, RefusesSettingsOutOfRange) {
  const auto refused = [](auto change) {
    MadeGigeSettings settings = small();
    change(settings);
    EXPECT_THROW(MadeGigeCamera(settings, telling_shot), std::invalid_argument);
  };
  refused([](auto& s) { s.width = 3; });
  refused([](auto& s) { s.formats = {"Mono13"}; });
  refused([](auto& s) { s.formats.clear(); });
  refused([](auto& s) { s.rate = 0; });
  refused([](auto& s) { s.rate = s.highest_rate + 1; });
  refused([](auto& s) { s.exposure_s = 0; });
  refused([](auto& s) { s.exposures = {1, 0.5}; });
  refused([](auto& s) { s.exposure_lag = -1; });
  refused([](auto& s) { s.packet_loss = 1.5; });
  refused([](auto& s) { s.first_block = 0; });
  refused([](auto& s) { s.serial = "more than 15 characters"; });
}

TEST(MadePicture, IsWhatTheSensorSees) {
  const auto light = std::make_shared<Image>();
  light->height = 1;
  light->width = 2;
  light->channels = 1;
  light->pixels = {0.25F, 3};
  MadeSensor sensor;
  sensor.read_noise_e = 0;
  sensor.full_well_e = 1e9;
  sensor.bits = 12;
  const MadeGigePicture picture = made_picture(sensor, [&](std::int64_t) { return light; });
  EXPECT_NEAR(picture({0, 1, 1}).codes[0], 4095 * 0.25, 1);
  EXPECT_NEAR(picture({0, 0.5, 1}).codes[0], 4095 * 0.125, 1);
  EXPECT_NEAR(picture({0, 0.5, 2}).codes[0], 4095 * 0.25, 1) << "by gain";
  EXPECT_EQ(picture({0, 1, 1}).codes[1], 4095) << "clipped";
}

}  // namespace
}  // namespace capture::made_gige_test
