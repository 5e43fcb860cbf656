// A small show for tests: a made plate of known frames, a cube on a plane, a sky.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include "capture/camera.h"
#include "capture/exr.h"
#include "capture/live_reader.h"
#include "studio/set.h"
#include "studio/start.h"
#include "tests/made_files.h"

namespace studio {

// A camera of grey frames: frame n is grey by (n % 50) / 100, 64x48, at a rate; every
// `lost_every`th one is lost (0 = none).
class GreyCamera : public capture::Camera {
 public:
  GreyCamera(std::int64_t frames, capture::Rational rate, std::int64_t lost_every)
      : frames_(frames), lost_every_(lost_every) {
    info_.width = 64;
    info_.height = 48;
    info_.rate = rate;
    info_.frames = frames;
  }
  const capture::CameraInfo& info() const override { return info_; }
  capture::CameraStatistics statistics() const override { return statistics_; }

  std::optional<capture::Frame> next() override {
    if (number_ == frames_) return std::nullopt;
    capture::Frame frame;
    frame.number = number_;
    frame.time = capture::time_of_frame(number_, info_.rate);
    if (lost_every_ > 0 && number_ % lost_every_ == lost_every_ - 1) {
      frame.status = capture::FrameStatus::lost;
      ++statistics_.lost;
    } else {
      auto image = std::make_shared<capture::Image>(capture::make_image(48, 64));
      for (float& v : image->pixels) v = 0.1F + static_cast<float>(number_ % 50) / 100;
      last_ = std::move(image);
    }
    frame.image = last_;
    ++number_;
    ++statistics_.delivered;
    return frame;
  }

 protected:
  capture::CameraInfo info_;

 private:
  capture::CameraStatistics statistics_;
  std::int64_t frames_, lost_every_, number_ = 0;
  std::shared_ptr<const capture::Image> last_;
};

// The same frames as time goes by: each comes when the monotonic clock says so.
class LiveGreyCamera final : public GreyCamera {
 public:
  LiveGreyCamera(std::int64_t frames, capture::Rational rate, std::int64_t lost_every)
      : GreyCamera(frames, rate, lost_every), begin_(capture::monotonic_now()) {
    info_.live = true;
  }
  std::optional<capture::Frame> next() override {
    auto frame = GreyCamera::next();
    if (!frame) return frame;
    frame->time += begin_;
    std::this_thread::sleep_for(frame->time - capture::monotonic_now());
    return frame;
  }

 private:
  capture::Time begin_;
};

// Opens "grey:FRAMES,FPS,LOST_EVERY" and "live_grey:FRAMES,FPS".
inline void register_grey_camera() {
  capture::register_camera("grey", [](std::string_view rest, const capture::CameraOptions&) {
    long frames = 0, fps = 0, lost_every = 0;
    EXPECT_EQ(std::sscanf(std::string(rest).c_str(), "%ld,%ld,%ld", &frames, &fps, &lost_every), 3);
    return std::make_unique<GreyCamera>(frames, capture::Rational{fps, 1}, lost_every);
  });
  capture::register_camera("live_grey", [](std::string_view rest, const capture::CameraOptions&) {
    long frames = 0, fps = 0;
    EXPECT_EQ(std::sscanf(std::string(rest).c_str(), "%ld,%ld", &frames, &fps), 2);
    return std::make_unique<LiveGreyCamera>(frames, capture::Rational{fps, 1}, 0);
  });
}

// Writes the set's files into a directory and returns the set's path.
inline std::string write_made_set(const std::filesystem::path& directory,
                                  const std::string& source,
                                  const std::string& more = "") {
  std::ofstream(directory / "cube.obj") << "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\n"
                                           "v -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\n"
                                           "f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\n"
                                           "f 3 7 8 4\nf 4 8 5 1\n";
  capture::Image sky = capture::make_image(32, 64);
  for (int y = 0; y < 16; ++y) {
    for (int x = 0; x < 64; ++x) {
      for (int c = 0; c < 3; ++c) sky.at(y, x, c) = y == 6 && x == 10 ? 400.0F : 0.5F;
    }
  }
  capture::write_exr((directory / "sky.exr").string(), sky);
  const std::string path = (directory / "made.toml").string();
  std::ofstream(path) << "[show]\nwidth = 64\nheight = 48\n"
                      << "[camera]\nsource = \"" << source << "\"\n"
                      << "model = \"pinhole\"\nfocal_px = 60\n"
                      << "pose = { position = [0, -8, 4], look_at = [0, 0, 0.5] }\n"
                      << "[probe]\nsource = \"sky.exr\"\nmatch = [1, 1, 1]\n"
                      << "[[object]]\nname = \"cube\"\nmesh = \"cube.obj\"\n"
                      << "[[stand_in]]\nname = \"ground\"\nsize = [20, 20]\n"
                      << "[effort]\nlight_samples = 16\naa_samples = 4\n"
                      << more;
  return path;
}

// Made shows, and a directory for each.
class MadeShowTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    start();
    register_grey_camera();
  }
  void SetUp() override { dir_ = made::make_temporary_directory(); }
  void TearDown() override { std::filesystem::remove_all(dir_); }

  Set made_set(const std::string& source, const std::string& more = "") const {
    return read_set(write_made_set(dir_, source, more));
  }

  std::filesystem::path dir_;
};

}  // namespace studio
