// Takes that end while the show goes on.
#include "studio/recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "compositing/exr_sequence.h"
#include "studio/show.h"
#include "tests/compositing/take.h"

namespace studio::recording_test {
namespace {

using compositing::FileSizeLimit;
using compositing::Rgb;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

class TakesOfAShow : public compositing::TakeTest {
 protected:
  TakesOfAShow() {
    form_.width = 1920;
    form_.height = 1080;
    form_.rate = {25, 1};
    std::mt19937 random(1);
    auto noise = std::make_shared<Rgb>(std::size_t{1920} * 1080 * 3);
    for (std::uint8_t& code : *noise) code = static_cast<std::uint8_t>(random());
    picture_ = std::move(noise);
  }

  RecordSettings take(const std::string& name) const {
    RecordSettings settings;
    settings.file = path(name);
    settings.codec = "lossless";
    return settings;
  }

  // Noise takes long to write: most wait when the last one is handed over.
  void record(Recording& recording, int frames) {
    ShownFrame shown;
    shown.rgb8 = picture_;
    for (int i = 0; i < frames; ++i) {
      shown.prepared.job.frame = next_++;
      recording.record(shown, false);
    }
  }

  std::string frames_of(const std::string& name) const {
    return compositing::probe(path(name), "stream=nb_read_frames",
                              "-count_frames -select_streams v:0");
  }

  RecordingForm form_;
  std::shared_ptr<const Rgb> picture_;
  std::int64_t next_ = 0;
};

TEST_F(TakesOfAShow, GoesOnWithAnotherTakeWhileTheLastOneIsFinished) {
  Recording recording(form_);
  recording.start(take("first.mkv"));
  record(recording, 30);
  recording.stop();
  EXPECT_FALSE(recording.running());
  EXPECT_TRUE(recording.finishing());
  EXPECT_FALSE(recording.status().finished);
  recording.start(take("second.mkv"));
  EXPECT_TRUE(recording.running());
  record(recording, 3);
  recording.stop();
  recording.finish();
  EXPECT_FALSE(recording.finishing());
  EXPECT_TRUE(recording.status().finished);
  EXPECT_EQ(recording.status().written, 3);
  EXPECT_EQ(frames_of("first.mkv"), "30");
  EXPECT_EQ(frames_of("second.mkv"), "3");
  EXPECT_THAT(recording.take_notes(), IsEmpty());
}

// Else two would write to one file, or the new take be refused for the old one's sake.
TEST_F(TakesOfAShow, WaitsForATakeOfTheSameFile) {
  Recording recording(form_);
  recording.start(take("take.mkv"));
  record(recording, 20);
  recording.stop();
  recording.start(take("take.mkv"));
  EXPECT_FALSE(recording.finishing());
  record(recording, 2);
  EXPECT_THROW(recording.start(take("take.mkv")), std::invalid_argument);
  EXPECT_TRUE(recording.running());
  recording.stop();
  recording.finish();
  EXPECT_EQ(frames_of("take.mkv"), "2");
}

// Their numbers tell them apart.
TEST_F(TakesOfAShow, GoOnInTheSameFolderOfFrames) {
  form_.width = form_.height = 16;
  Recording recording(form_);
  RecordSettings frames;
  frames.exr = path("frames");
  auto result = std::make_shared<render::FrameResult>();
  result->rgba = {16, 16, std::vector<capture::Half>(16 * 16 * 4), 4};
  result->matte = {16, 16, std::vector<capture::Half>(16 * 16), 1};
  ShownFrame shown;
  shown.result = result;
  for (int take = 0; take < 2; ++take) {
    recording.start(frames);
    shown.prepared.job.frame = take;
    recording.record(shown, false);
  }
  recording.stop();
  recording.finish();
  EXPECT_EQ(recording.status().error, "");
  EXPECT_EQ(compositing::ExrSequence::frames_in(frames.exr), 2);
}

TEST_F(TakesOfAShow, WriteEachOfManyThatFollowAtOnce) {
  Recording recording(form_);
  for (int i = 0; i < 6; ++i) {
    recording.start(take(std::to_string(i) + ".mkv"));
    record(recording, 8);
  }
  recording.stop();
  recording.finish();
  for (int i = 0; i < 6; ++i) EXPECT_EQ(frames_of(std::to_string(i) + ".mkv"), "8");
}

// Nobody has looked at its status meanwhile.
TEST_F(TakesOfAShow, TellsOfATakeThatFailedBeforeAnotherOfItsFile) {
  Recording recording(form_);
  recording.start(take("take.mkv"));
  {
    const FileSizeLimit full(std::uintmax_t{2} << 20);
    record(recording, 30);
    recording.stop();
    recording.start(take("take.mkv"));
  }
  EXPECT_THAT(recording.take_notes(), Contains(HasSubstr(path("take.mkv"))));
  EXPECT_EQ(recording.status().error, "");
}

TEST_F(TakesOfAShow, TellsOfATakeThatFailedWhileItWasFinished) {
  Recording recording(form_);
  recording.start(take("first.mkv"));
  {
    const FileSizeLimit full(std::uintmax_t{2} << 20);
    record(recording, 30);
    recording.stop();
    RecordSettings small = take("second.mkv");
    recording.start(small);
    recording.finish();
  }
  EXPECT_EQ(recording.status().error, "");
  EXPECT_THAT(recording.take_notes(), Contains(HasSubstr(path("first.mkv"))));
  EXPECT_THAT(recording.take_notes(), IsEmpty());
  record(recording, 1);
  recording.stop();
  recording.finish();
  EXPECT_EQ(recording.status().error, "");
  EXPECT_EQ(frames_of("second.mkv"), "1");
}

}  // namespace
}  // namespace studio::recording_test
