// Recordings: what is played again is what the camera gave.
#include "capture/recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <vector>

#include "capture/coded_file.h"
#include "capture/live_merge.h"
#include "capture/replay.h"
#include "capture/v4l2_camera.h"
#include "tests/capture/fake_v4l2.h"

namespace capture::recording_test {
namespace {

using testing::HasSubstr;

class RecordingTest : public testing::Test {
 protected:
  RecordingTest() {
    std::string pattern = testing::TempDir() + "recording_XXXXXX";
    folder_ = mkdtemp(pattern.data());
  }
  ~RecordingTest() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path take() const { return folder_ / "take"; }

  // What happens when `act` is refused.
  template <class Act>
  static std::string refusal(const Act& act) {
    try {
      act();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    ADD_FAILURE() << "it was not refused";
    return {};
  }

  std::filesystem::path folder_;
};

CodedPicture made_picture(std::uint32_t fourcc, std::size_t bytes, unsigned seed) {
  CodedPicture picture;
  picture.layout = {fourcc, 64, 48, 0, V4L2_COLORSPACE_SRGB, 0, 0, 0};
  std::mt19937 random(seed);
  picture.bytes.resize(bytes);
  for (std::byte& one : picture.bytes) one = static_cast<std::byte>(random() & 0xff);
  return picture;
}

// Frames of a V4L2 camera that drops, damages and loses some; the exposures as a schedule made
// them.
std::vector<Frame> live_frames(std::uint32_t fourcc, std::size_t picture_bytes) {
  const auto io = std::make_shared<made::FakeV4l2>();
  made::FakeDevice& device = io->devices.front();
  device.formats = {{fourcc, {{64, 48, {30}}}}};
  CameraOptions options;
  options.keep_coded = true;
  device.picture = made_picture(fourcc, picture_bytes, 1).bytes;
  const auto camera = open_v4l2("/dev/video0", options, {options.colour, std::nullopt}, io);
  std::vector<Frame> frames;
  for (unsigned i = 0; i < 12; ++i) {
    made::FakeEvent event;
    if (i == 3) event.sequence_step = 3;
    if (i == 5) event.flags = V4L2_BUF_FLAG_ERROR;
    if (i == 7) event.bytes_short = 100;
    device.events = {event};
    device.picture = made_picture(fourcc, picture_bytes, i).bytes;
    frames.push_back(*camera->next());
    constexpr double cycle[] = {1.0 / 60, 1.0 / 3000, 1e-5 / 3};
    frames.back().exposure_s = i == 4 ? 0 : cycle[i % 3];
  }
  return frames;
}

TEST_F(RecordingTest, PlaysTheVeryFramesThatTheCameraGave) {
  struct Format {
    std::uint32_t fourcc;
    std::size_t bytes;
  };
  for (const Format format :
       {Format{V4L2_PIX_FMT_YUYV, 64 * 48 * 2}, Format{V4L2_PIX_FMT_Y12, 64 * 48 * 2},
        Format{V4L2_PIX_FMT_SRGGB12, 64 * 48 * 2}}) {
    const std::filesystem::path take = folder_ / std::to_string(format.fourcc);
    const std::vector<Frame> live = live_frames(format.fourcc, format.bytes);
    FrameRecording recording(take);
    for (const Frame& frame : live) recording.add(frame);
    recording.finish();
    EXPECT_EQ(recording.statistics().frames, 12);
    EXPECT_EQ(recording.statistics().skipped, 0);

    const auto replay = open_replay(take, {}, {});
    for (const Frame& frame : live) {
      const auto again = replay->next();
      ASSERT_TRUE(again);
      EXPECT_EQ(again->status, frame.status) << frame.number;
      EXPECT_EQ(again->time, frame.time - live.front().time) << frame.number;
      EXPECT_EQ(again->exposure_s, frame.exposure_s) << frame.number;
      ASSERT_TRUE(again->image);
      EXPECT_EQ(again->image->pixels, frame.image->pixels) << frame.number;
    }
    EXPECT_FALSE(replay->next());
  }
}

TEST_F(RecordingTest, GivesTheSameHdrFrames) {
  const std::vector<Frame> live = live_frames(V4L2_PIX_FMT_SRGGB12, 64 * 48 * 2);
  FrameRecording recording(take());
  for (const Frame& frame : live) recording.add(frame);
  recording.finish();
  const auto replay = open_replay(take(), {}, {});
  std::vector<Frame> again;
  while (auto frame = replay->next()) again.push_back(*frame);
  ASSERT_EQ(again.size(), live.size());
  const auto merge = [](const std::vector<Frame>& frames, std::size_t last) {
    std::vector<LiveShot> window;
    for (std::size_t i = last - 2; i <= last; ++i) {
      window.push_back({frames[i].image.get(), frames[i].exposure_s});
    }
    MergedFrame merged;
    merge_window(window, {}, merged);
    return merged.radiance.pixels;
  };
  for (const std::size_t last : {2U, 8U, 11U}) EXPECT_EQ(merge(live, last), merge(again, last));
}

TEST_F(RecordingTest, PlaysUpToWhereItWasCutOff) {
  const std::vector<Frame> live = live_frames(V4L2_PIX_FMT_Y12, 64 * 48 * 2);
  {
    FrameRecording recording(take());
    for (const Frame& frame : live) recording.add(frame);
  }
  std::filesystem::resize_file(take() / "000009.coded", 1000);
  const auto replay = open_replay(take(), {}, {});
  for (int i = 0; i < 9; ++i) EXPECT_TRUE(replay->next());
  const auto cut = replay->next();
  ASSERT_TRUE(cut);
  EXPECT_EQ(cut->status, FrameStatus::lost);
  EXPECT_THAT(cut->note, HasSubstr("000009.coded: it should hold 6144 bytes"));
}

TEST_F(RecordingTest, CountsWhatIsThereOnceAFileCannotBeWritten) {
  const std::vector<Frame> live = live_frames(V4L2_PIX_FMT_Y12, 64 * 48 * 2);
  FrameRecording recording(take());
  std::filesystem::create_directory(take() / "000005.coded");  // in its way
  EXPECT_THAT(refusal([&] {
                for (const Frame& frame : live) recording.add(frame);
                recording.finish();
              }),
              HasSubstr("000005.coded"));
  EXPECT_EQ(recording.statistics().frames, 5);
  const auto replay = open_replay(take(), {}, {});
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(replay->next());
  EXPECT_FALSE(replay->next());
}

TEST_F(RecordingTest, RefusesAFolderWithARecording) {
  { FrameRecording recording(take()); }
  EXPECT_THAT(refusal([&] { FrameRecording again(take()); }), HasSubstr("holds a recording"));
  std::ofstream(folder_ / "file") << "x";
  EXPECT_THAT(refusal([&] { FrameRecording in_file(folder_ / "file"); }), HasSubstr("file"));
}

TEST_F(RecordingTest, RefusesFramesWithoutTheirBytes) {
  FrameRecording recording(take());
  EXPECT_THROW(recording.add(Frame{}), std::invalid_argument);
  Frame lost;
  lost.status = FrameStatus::lost;
  recording.add(lost);
  recording.finish();
  EXPECT_EQ(recording.statistics().lost, 1);
}

TEST_F(RecordingTest, RefusesDamagedPictures) {
  const std::string path = folder_ / "one.coded";
  const CodedPicture picture = made_picture(V4L2_PIX_FMT_Y12, 100, 1);
  write_coded_file(path, picture);
  const CodedPicture again = read_coded_file(path);
  EXPECT_EQ(again.layout, picture.layout);
  EXPECT_EQ(again.bytes, picture.bytes);
  EXPECT_THAT(refusal([&] {
                Image image;
                CodedFileReader({}).read(path, image);
              }),
              HasSubstr("one.coded: the picture is cut short"));
  std::filesystem::resize_file(path, 20);
  EXPECT_THAT(refusal([&] { read_coded_file(path); }),
              HasSubstr("it is no picture of a recording"));
  CodedPicture no_size = picture;
  no_size.layout.width = 0;
  write_coded_file(path, no_size);
  EXPECT_THAT(refusal([&] { read_coded_file(path); }), HasSubstr("no size"));
  CodedPicture unknown = picture;
  unknown.layout.fourcc = 0x20202020;
  write_coded_file(path, unknown);
  EXPECT_THAT(refusal([&] {
                Image image;
                CodedFileReader({}).read(path, image);
              }),
              HasSubstr("is not read"));
}

}  // namespace
}  // namespace capture::recording_test
