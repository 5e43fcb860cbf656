// A bracketed camera over a made one: each frame with the exposure that made it.
#include "capture/bracketed_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/capture/made_exposure_stream.h"

namespace capture::bracketed_camera_test {
namespace {

using made::ExposureStream;
using made::MadeFrame;
using made::no_faults;
using made::StreamFaults;

// What the test sees of a camera that the bracket owns.
struct Script {
  std::vector<double> made_s;  // what made the frames, by number; 0 = lost or mixed
  bool refuses = false;
  std::optional<double> told_s = std::nullopt;  // of exposures that were set
  bool settable = true;
};

// A camera at 60 frames a second whose device rounds exposures to 100 us.
class MadeCamera final : public Camera {
 public:
  static constexpr double unit_s = 1e-4;

  MadeCamera(const StreamFaults& faults, std::uint64_t seed, std::shared_ptr<Script> script)
      : stream_({.exposures_s = {1e-3, 4e-3, 16e-3}, .stops = 6, .drift = 0.01}, faults, seed),
        script_(std::move(script)) {
    info_ = {.width = ExposureStream::columns,
             .height = ExposureStream::rows,
             .rate = {60, 1},
             .frames = 0,
             .description = {},
             .doubt = {}};
  }
  const CameraInfo& info() const override { return info_; }
  CameraStatistics statistics() const override { return {}; }
  std::optional<ExposureRange> exposure_range() const override {
    return script_->settable ? std::optional(ExposureRange{unit_s, 1}) : std::nullopt;
  }
  double set_exposure(double exposure_s) override {
    if (script_->refuses) throw std::runtime_error("made: camera: busy");
    const double taken_s = unit_s * std::round(exposure_s / unit_s);
    stream_.request(taken_s);
    return script_->told_s.value_or(taken_s);
  }
  std::optional<Frame> next() override {
    if (!waiting_) waiting_ = stream_.next();
    Frame frame;
    frame.number = number_++;
    if (frame.number < waiting_->number) {
      frame.status = FrameStatus::lost;
      script_->made_s.push_back(0);
      return frame;
    }
    frame.image = std::make_shared<const Image>(
        Image{ExposureStream::rows, ExposureStream::columns, waiting_->thumbnail.values});
    const auto& rows = waiting_->row_exposure_s;
    script_->made_s.push_back(rows.front() == rows.back() ? rows[0] : 0);
    waiting_.reset();
    return frame;
  }
  NoiseModel noise() const { return stream_.noise(); }

 private:
  CameraInfo info_;
  ExposureStream stream_;
  std::shared_ptr<Script> script_;
  std::optional<MadeFrame> waiting_;
  std::int64_t number_ = 0;
};

const std::vector<double> bracket_s{1e-3, 4.04e-3, 16e-3};

BracketedCamera bracketed(const StreamFaults& faults,
                          std::uint64_t seed,
                          const std::shared_ptr<Script>& script,
                          const std::vector<double>& exposures_s = bracket_s) {
  auto camera = std::make_unique<MadeCamera>(faults, seed, script);
  const LabelSettings settings{.noise = camera->noise()};
  return {std::move(camera), "made:", exposures_s, settings};
}

TEST(BracketedCamera, SaysOfEachFrameWhatMadeIt) {
  const auto script = std::make_shared<Script>();
  BracketedCamera camera = bracketed(no_faults, 1, script);
  EXPECT_THAT(camera.exposures_s(),
              testing::ElementsAre(testing::DoubleEq(1e-3), testing::DoubleEq(4e-3),
                                   testing::DoubleEq(16e-3)));
  int accepted = 0;
  int damaged = 0;
  for (int i = 0; i < 100; ++i) {
    const Frame frame = camera.next().value();
    accepted += frame.exposure_s > 0 && frame.note.empty();
    damaged += frame.status == FrameStatus::damaged;
    if (i < 15 && frame.exposure_s == 0) {
      EXPECT_NE(frame.note, "");
      continue;
    }
    EXPECT_EQ(frame.status, FrameStatus::good) << i << " " << frame.note;
    EXPECT_EQ(frame.exposure_s, script->made_s.back());
  }
  EXPECT_TRUE(camera.statistics().exposure_lag);
  EXPECT_GE(accepted, 85);
  EXPECT_EQ(camera.statistics().damaged, damaged);
  EXPECT_EQ(camera.statistics().refused, 0);
}

TEST(BracketedCamera, SaysNothingWrongOfAFaultyCamera) {
  const auto script = std::make_shared<Script>();
  StreamFaults faults;
  faults.reconnect = 0.005;
  BracketedCamera camera = bracketed(faults, 5, script);
  int labelled = 0;
  for (int i = 0; i < 3000; ++i) {
    const Frame frame = camera.next().value();
    EXPECT_EQ(frame.number, i);
    if (frame.exposure_s == 0) continue;
    ++labelled;
    EXPECT_EQ(frame.status, FrameStatus::good);
    EXPECT_EQ(frame.exposure_s, script->made_s.back());
  }
  EXPECT_GE(labelled, 1500);
}

TEST(BracketedCamera, GoesOnWhereTheCameraRefuses) {
  const auto script = std::make_shared<Script>();
  BracketedCamera camera = bracketed(no_faults, 1, script);
  for (int i = 0; i < 200; ++i) {
    script->refuses = i >= 50 && i < 60;
    const Frame frame = camera.next().value();
    if (frame.exposure_s > 0) {
      EXPECT_EQ(frame.exposure_s, script->made_s.back());
    }
    if (i > 100) {
      EXPECT_EQ(frame.status, FrameStatus::good) << frame.note;
    }
  }
  EXPECT_EQ(camera.statistics().refused, 10);
  EXPECT_EQ(camera.statistics().refusal, "made: camera: busy");
}

TEST(BracketedCamera, GoesOnWhereTheCameraTellsNoExposure) {
  for (const double none_s : {0.0, -1.0, std::nan("")}) {
    const auto script = std::make_shared<Script>();
    BracketedCamera camera = bracketed(no_faults, 1, script);
    for (int i = 0; i < 20; ++i) camera.next();
    script->told_s = none_s;
    EXPECT_TRUE(camera.next());
    script->told_s.reset();
    EXPECT_TRUE(camera.next());
    EXPECT_EQ(camera.statistics().refused, 1);
    EXPECT_THAT(camera.statistics().refusal, testing::HasSubstr("the camera tells"));
  }
}

TEST(BracketedCamera, ChangesOneExposureWhileItRuns) {
  const auto script = std::make_shared<Script>();
  BracketedCamera camera = bracketed(no_faults, 1, script);
  for (int i = 0; i < 40; ++i) camera.next();
  camera.set_exposures(std::array{1e-3, 2.03e-3, 16e-3});
  int changed = 0;
  for (int i = 0; i < 60; ++i) {
    const Frame frame = camera.next().value();
    EXPECT_EQ(frame.status, FrameStatus::good) << frame.note;
    if (frame.exposure_s > 0) {
      EXPECT_EQ(frame.exposure_s, script->made_s.back());
    }
    changed += std::abs(frame.exposure_s - 2e-3) < 1e-9;
  }
  EXPECT_GE(changed, 10);
}

std::string fault_of(const std::shared_ptr<Script>& script,
                     const std::vector<double>& exposures_s) {
  try {
    bracketed(no_faults, 1, script, exposures_s);
  } catch (const std::runtime_error& fault) {
    return fault.what();
  }
  return "";
}

TEST(BracketedCamera, RefusesWhatTheCameraCannotDo) {
  const auto script = std::make_shared<Script>();
  EXPECT_THAT(fault_of(script, {1e-5, 1e-2}), testing::HasSubstr("only 0.0001 s to 1 s"));
  EXPECT_THAT(fault_of(script, {1e-3, 0.5}), testing::HasSubstr("longer than a frame"));
  EXPECT_THAT(fault_of(script, {1.1e-4, 1.2e-4}), testing::HasSubstr("are one to the camera"));
  EXPECT_THROW(bracketed(no_faults, 1, script, {}), std::invalid_argument);
  script->refuses = true;
  EXPECT_THAT(fault_of(script, bracket_s), testing::HasSubstr("busy"));
  script->settable = false;
  EXPECT_THAT(fault_of(script, bracket_s), testing::HasSubstr("cannot be set"));
}

}  // namespace
}  // namespace capture::bracketed_camera_test
