// What a show tells, and its takes: started, stopped, refused.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "studio/figures.h"
#include "studio/recording.h"
#include "studio/show.h"
#include "studio/timed_source.h"
#include "tests/capture/made_light_camera.h"
#include "tests/independent_plate.h"
#include "tests/studio/made_show.h"

namespace studio::show_notes_test {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

using ShowNotes = MadeShowTest;

TEST_F(ShowNotes, NotesAPlateThatEndsEarly) {
  ShowOptions options;
  options.frames = 9;
  Show show(made_set("grey:4,25,0"), options);
  show.run();
  EXPECT_THAT(show.status()->notes, Contains(HasSubstr("ended after 4 of 9 frames")));
}

// Whatever is played from a file, and whether it loops or not: once.
TEST_F(ShowNotes, NotesFilesThatAreCutShort) {
  const std::string clip = (dir_ / "cut.mkv").string();
  independent::ffmpeg("-f lavfi -i testsrc2=size=64x48:rate=25:duration=0.8 -c:v ffv1 '" + clip +
                      "'");
  std::filesystem::resize_file(clip, std::filesystem::file_size(clip) / 2);
  const std::string person =
      "[[billboard]]\nname = \"extra\"\nsource = \"cut.mkv\"\n"
      "position = [2, 0, 0]\nheight = 1.8\n";
  const std::string video =
      "[[object]]\nname = \"set\"\nmade = \"tv\"\n"
      "[[video]]\nobject = \"set\"\nsource = \"cut.mkv\"\n";
  const auto notes_of = [&](const std::string& plate, const std::string& more) {
    ShowOptions options;
    options.frames = 30;
    Show show(read_set(write_made_set(dir_, plate, more)), options);
    show.run();
    return show.status()->notes;
  };
  const auto told = HasSubstr("s that it tells of are not there");
  EXPECT_THAT(notes_of("cut.mkv", ""), Contains(AllOf(StartsWith("the plate: "), told)).Times(1));
  for (const std::string loop : {"", "loop = true\n"}) {
    EXPECT_THAT(notes_of("grey:30,25,0", person + loop),
                Contains(AllOf(StartsWith("extra is not whole: "), told)).Times(1));
    EXPECT_THAT(notes_of("grey:30,25,0", video + loop),
                Contains(AllOf(HasSubstr("is not whole: "), told)).Times(1));
  }
}

TEST_F(ShowNotes, NotesLostFramesOfThePlateOnceInARow) {
  Show show(made_set("grey:9,25,4"));
  show.run();
  const std::vector<std::string> notes = show.status()->notes;
  EXPECT_EQ(std::ranges::count_if(notes,
                                  [](const std::string& note) {
                                    return note.find("the plate's frame") != std::string::npos;
                                  }),
            2);
}

// Frames 5 to 44 of 60 are lost.
class GapCamera final : public GreyCamera {
 public:
  GapCamera() : GreyCamera(60, {25, 1}, 0) {}
  std::optional<capture::Frame> next() override {
    auto frame = GreyCamera::next();
    if (frame && frame->number >= 5 && frame->number < 45) {
      frame->status = capture::FrameStatus::lost;
      frame->note = "no picture came";
    }
    return frame;
  }
};

// Frames that came, but not whole.
class DamagedCamera : public GreyCamera {
 public:
  DamagedCamera() : GreyCamera(12, {25, 1}, 0) {}
  std::optional<capture::Frame> next() override {
    auto frame = GreyCamera::next();
    if (frame && frame->number >= 5) {
      frame->status = capture::FrameStatus::damaged;
      frame->note = "its stream is damaged";
    }
    return frame;
  }
};

TEST_F(ShowNotes, NotesTheFirstFrameOfThePlateThatIsDamaged) {
  capture::register_camera("damaged", [](std::string_view, const capture::CameraOptions&) {
    return std::make_unique<DamagedCamera>();
  });
  Show show(made_set("damaged:"));
  show.run();
  EXPECT_THAT(show.status()->notes,
              Contains("the plate's frame 5 is damaged: its stream is damaged").Times(1));
  EXPECT_THAT(show.status()->notes, Not(Contains(HasSubstr("frame 6 is damaged"))));
}

TEST_F(ShowNotes, NotesThatThePlateIsGoneAndThatItIsBack) {
  capture::register_camera("gap", [](std::string_view, const capture::CameraOptions&) {
    return std::make_unique<GapCamera>();
  });
  Show show(made_set("gap:"));
  show.run();
  const auto& notes = show.status()->notes;
  EXPECT_THAT(notes, Contains(HasSubstr("frame 5 is lost: no picture came")));
  EXPECT_THAT(notes,
              Contains(HasSubstr("the plate is gone, and its last picture stays: no picture")));
  EXPECT_THAT(notes, Contains(HasSubstr("the plate is back after 1.6 s")));
  EXPECT_GT(show.status()->fps_now, 0);
}

TEST_F(ShowNotes, NotesThatTheCamerasTrackHasEnded) {
  std::ofstream(dir_ / "track.csv") << "time_s,px,py,pz,qw,qx,qy,qz\n"
                                       "0,0,-8,4,0.7,-0.7,0,0\n0.1,0,-8,4,0.7,-0.7,0,0\n";
  Set set = made_set("grey:9,25,0");
  set.camera.pose.track = (dir_ / "track.csv").string();
  Show show(set);
  show.run();
  EXPECT_THAT(show.status()->notes, ElementsAre(HasSubstr("no pose at 0.120 s")));
}

TEST_F(ShowNotes, NotesWhatIsToBeDoubtedOfThePlateAndItsTrack) {
  const std::string clip = (dir_ / "fields.mkv").string();
  independent::ffmpeg(
      "-f lavfi -i testsrc2=size=64x48:rate=50:duration=0.4 -vf tinterlace=interleave_top -c:v "
      "mpeg2video -flags +ildct+ilme -top 1 '" +
      clip + "'");
  std::ofstream(dir_ / "track.csv") << "time_s,px,py,pz,qw,qx,qy,qz\n"
                                       "0,0,-8,4,0.7,0.7,0,0\n9,0,-8,4,0.7,0.7,0,0\n";
  Set set = made_set("file:" + clip);
  set.camera.pose.track = (dir_ / "track.csv").string();
  EXPECT_THAT(
      check_show(set),
      AllOf(Contains(StartsWith("the plate: it is marked as interlaced, and is deinterlaced")),
            Contains(AllOf(StartsWith("the camera's track is doubtful: the camera hangs "
                                      "upside down throughout"),
                           HasSubstr("track.csv")))));
  set.camera.deinterlace = false;
  EXPECT_THAT(check_show(set), Not(Contains(HasSubstr("interlaced"))));
  VideoSource video;
  video.uri = "file:" + clip;
  EXPECT_THAT(open_video(video)->info().description, HasSubstr("(deinterlaced)"));
  video.deinterlace = false;
  EXPECT_THAT(open_video(video)->info().description, HasSubstr("interlaced (taken as it is)"));
  EXPECT_THAT(check_show(made_set("grey:9,25,0")), testing::IsEmpty());
}

// What is written to is as slow as a disk that others write to.
TEST_F(ShowNotes, NotesFramesThatAreMissingInARecording) {
  Set set = made_set("grey:400,25,0");
  set.record.file = (dir_ / "pipe.mkv").string();
  set.record.codec = "lossless";
  ASSERT_EQ(::mkfifo(set.record.file.c_str(), 0600), 0);
  std::atomic<bool> told = false;
  const int pipe = ::open(set.record.file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  ASSERT_GE(pipe, 0);
  ::fcntl(pipe, F_SETFL, 0);
  ::fcntl(pipe, F_SETPIPE_SZ, 4096);
  std::thread reader([&] {
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!told && std::chrono::steady_clock::now() < give_up) std::this_thread::yield();
    std::array<char, 4096> bytes;
    while (::read(pipe, bytes.data(), bytes.size()) > 0) continue;
    ::close(pipe);
  });
  ShowOptions options;
  options.live = true;
  Show show(set, options);
  const auto missing = Contains(HasSubstr("frames are missing in the recording")).Times(1);
  show.run([&](const ShownFrame&) {
    if (show.status()->recorder.dropped == 0) return;
    told = true;
    show.post(Quit{});
  });
  told = true;
  reader.join();
  EXPECT_THAT(show.status()->notes, missing);
  EXPECT_GT(show.status()->recorder.dropped, 0);
}

// A still stands for all times: the camera moves before it.
TEST_F(ShowNotes, FollowsATrackOverAStill) {
  std::ofstream(dir_ / "track.csv") << "time_s,px,py,pz,qw,qx,qy,qz\n"
                                       "0,0,-8,4,0.7,-0.7,0,0\n0.2,2,-8,4,0.7,-0.7,0,0\n";
  Set set = made_set("grey:1,25,0");
  set.camera.pose.track = (dir_ / "track.csv").string();
  FrameMaker maker(set);
  const auto at = [&](std::int64_t frame) {
    return calibrate::position_of(maker.make(frame).value().job.cam_from_set);
  };
  EXPECT_NEAR(at(0).x, 0, 1e-5);
  EXPECT_NEAR(at(2).x, 0.8, 1e-5);
  EXPECT_NEAR(at(9).x, 2, 1e-5);
}

TEST_F(ShowNotes, GoesOnRecordingWhereTheNextTakeCannotBe) {
  ShowOptions options;
  options.frames = 12;
  Show show(made_set("grey:1,25,0"), options);
  RecordSettings good, bad;
  good.exr = (dir_ / "take").string();
  bad.exr = good.exr;
  bad.timecode = "99:00:00:00";
  RecordSettings no_folder;
  no_folder.exr = (dir_ / "cube.obj" / "take").string();
  show.post(StartRecording{good});
  show.run([&](const ShownFrame& shown) {
    if (shown.prepared.job.frame == 2) show.post(StartRecording{bad});
    if (shown.prepared.job.frame == 3) show.post(StartRecording{no_folder});
  });
  EXPECT_THAT(show.status()->notes, Contains(HasSubstr("99:00:00:00")));
  EXPECT_THAT(show.status()->notes, Contains(HasSubstr("cube.obj")));
  EXPECT_EQ(show.status()->recorder.written, 12);
  // Another show says what is there.
  Show again(made_set("grey:1,25,0"), options);
  again.post(StartRecording{good});
  again.run();
  EXPECT_THAT(again.status()->notes, Contains(HasSubstr("has 12 frames already")));
}

TEST_F(ShowNotes, RecordsNoTakeOverTheOneThatRuns) {
  ShowOptions options;
  options.frames = 8;
  Show show(made_set("grey:1,25,0"), options);
  RecordSettings take;
  take.file = (dir_ / "take.mkv").string();
  show.post(StartRecording{take});
  show.run([&](const ShownFrame& shown) {
    if (shown.prepared.job.frame == 4) show.post(StartRecording{take});
  });
  EXPECT_THAT(show.status()->notes, Contains(HasSubstr("take.mkv is what is recorded to")));
  EXPECT_EQ(show.status()->recorder.written, 8);
}

TEST_F(ShowNotes, NotesThatAnEarlierTakeIsReplaced) {
  ShowOptions options;
  options.frames = 2;
  RecordSettings take;
  take.fill = (dir_ / "fill.mkv").string();
  take.key = (dir_ / "key.mkv").string();
  std::ofstream(take.key) << "a take of before";
  Show show(made_set("grey:1,25,0"), options);
  show.post(StartRecording{take});
  show.run();
  EXPECT_THAT(show.status()->notes, Contains(HasSubstr(take.key + " was there already")));
  EXPECT_THAT(show.status()->notes, Not(Contains(HasSubstr(take.fill))));
  EXPECT_EQ(show.status()->recorder.written, 2);
}

// A disk that stalls must not fill the memory with what is not recorded.
TEST_F(ShowNotes, KeepNoPicturesThatATakeDoesNotWrite) {
  RecordingForm form;
  form.width = 320;
  form.height = 240;
  form.rate = {25, 1};
  Recording recording(form);
  RecordSettings take;
  take.file = (dir_ / "take.mkv").string();
  recording.start(take);
  ShownFrame shown;
  shown.result = std::make_shared<const render::FrameResult>();
  shown.prepared.plate = std::make_shared<const capture::HalfImage>();
  shown.rgb8 = std::make_shared<const std::vector<std::uint8_t>>(320 * 240 * 3, std::uint8_t{90});
  for (int n = 0; n < 20; ++n) {
    shown.prepared.job.frame = n;
    recording.record(shown, true);
    EXPECT_EQ(shown.result.use_count(), 1) << n;
    EXPECT_EQ(shown.prepared.plate.use_count(), 1) << n;
  }
  recording.stop();
  recording.finish();
  EXPECT_EQ(recording.status().written, 20);
}

// What is told of every frame does not hide what is told once.
TEST_F(ShowNotes, KeepsNotesOfEveryKind) {
  Show show(
      made_set("grey:60,25,2",
               "[[billboard]]\nsource = \"grey:3,25,0\"\nheight = 2\nposition = [0, 0, 0]\n"));
  show.run();
  EXPECT_THAT(show.status()->notes, Contains(HasSubstr("has ended")));
  EXPECT_THAT(show.status()->notes, Contains(HasSubstr("the plate's frame")));
}

TEST_F(ShowNotes, GivesFramesAllNotesSinceTheOneBefore) {
  ShowOptions options;
  options.frames = 2;
  Show show(made_set("grey:1,25,0"), options);
  for (char name = 'a'; name < 'p'; ++name) show.post(MoveObject{std::string("no ") + name, {}});
  std::vector<std::vector<std::string>> told;
  show.run([&](const ShownFrame& shown) { told.push_back(shown.notes); });
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].size(), 15U);
  EXPECT_THAT(told[0], Contains(HasSubstr("\"no a\"")));
  EXPECT_THAT(told[1], ElementsAre());
  EXPECT_EQ(show.status()->notes.size(), 10U);
}

TEST_F(ShowNotes, NotesWhatACommandCannotDoAndGoesOn) {
  ShowOptions options;
  options.frames = 5;
  Show show(made_set("grey:1,25,0"), options);
  show.post(MoveObject{"no such thing", {}});
  RecordSettings record;
  record.file = "/proc/nowhere/take.mkv";
  show.post(StartRecording{record});
  Set smaller = made_set("grey:1,25,0");
  smaller.show.width = 32;
  show.post(ChangeSet{smaller});
  show.run();
  EXPECT_EQ(show.status()->frames, 5);
  EXPECT_THAT(show.status()->notes, Contains(HasSubstr("no such thing")));
  EXPECT_THAT(show.status()->notes, Contains(HasSubstr("/proc/nowhere")));
  EXPECT_THAT(show.status()->notes, Contains(HasSubstr("size and rate")));
}

// Its sound is of another rate than it says from a frame on.
class HoarseCamera final : public GreyCamera {
 public:
  explicit HoarseCamera(std::int64_t first) : GreyCamera(20, {25, 1}, 0), first_(first) {
    info_.sound_channels = 1;
    info_.sound_rate = 8000;
  }
  std::optional<capture::Frame> next() override {
    auto frame = GreyCamera::next();
    if (frame) {
      const int rate = frame->number < first_ ? 8000 : 16000;
      sound_ = {frame->time, 1, rate, std::vector<float>(static_cast<std::size_t>(rate / 25))};
    }
    return frame;
  }
  std::optional<capture::Sound> take_sound(capture::Time) override {
    return std::exchange(sound_, {});
  }

 private:
  std::int64_t first_;
  std::optional<capture::Sound> sound_;
};

TEST_F(ShowNotes, TellsOnceARecordingThatSoundIsMissing) {
  capture::register_camera("hoarse", [](std::string_view rest, const capture::CameraOptions&) {
    return std::make_unique<HoarseCamera>(std::stol(std::string(rest)));
  });
  const auto missing_of = [](const std::vector<std::string>& notes) {
    return std::ranges::count_if(notes, [](const std::string& note) {
      return note.find("sound is missing in the recording") != std::string::npos;
    });
  };
  for (const int first : {10, 20}) {
    const Set set = made_set("hoarse:" + std::to_string(first),
                             "[record]\nfile = \"" + (dir_ / "take.mkv").string() + "\"\n");
    Show show(set);
    show.run();
    const ShowStatus status = *show.status();
    EXPECT_EQ(status.recorder.sounds_left_out > 0, first < 20);
    EXPECT_LE(status.recorder.sounds_left_out, 20 - first);
    EXPECT_EQ(missing_of(status.notes), first < 20 ? 1 : 0);
    const std::string figure =
        "\"sounds_left_out\": " + std::to_string(status.recorder.sounds_left_out);
    EXPECT_THAT(show_figures(set, status, {}), HasSubstr(figure));
  }
}

// Refuses exposures once it is told to.
class UnwillingCamera final : public made::LightCamera {
 public:
  UnwillingCamera(const std::shared_ptr<made::LightScript>& script,
                  const std::atomic<bool>& refuses)
      : LightCamera(script), refuses_(refuses) {
    info_.live = true;
  }
  double set_exposure(double exposure_s) override {
    if (refuses_) throw std::runtime_error("unwilling: it is busy");
    return LightCamera::set_exposure(exposure_s);
  }
  std::optional<capture::Frame> next() override {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    auto frame = LightCamera::next();
    frame->time = capture::monotonic_now();
    return frame;
  }

 private:
  const std::atomic<bool>& refuses_;
};

TEST_F(ShowNotes, TellsOnceThatTheProbesCameraRefusesExposures) {
  std::atomic<bool> refuses = false;
  const auto script = std::make_shared<made::LightScript>();
  capture::register_camera("unwilling", [&](std::string_view, const capture::CameraOptions&) {
    return std::make_unique<UnwillingCamera>(script, refuses);
  });
  Set set = made_set("grey:100000,25,0");
  set.probe->kind = ProbeSettings::Kind::camera;
  set.probe->source = "unwilling:";
  set.probe->lens = calibrate::Lens{.model = "equisolid",
                                    .width = 96,
                                    .height = 96,
                                    .parameters = {34, 47.5, 47.5},
                                    .max_angle_rad = 1.5707963};
  Show show(set);
  show.run([&](const ShownFrame&) {
    const std::shared_ptr<const ShowStatus> status = show.status();
    if (status->frames == 1) {
      EXPECT_EQ(status->probe.refused, 0);
      refuses = true;
    }
    if (status->probe.refused > 4) show.post(Quit{});
  });
  const ShowStatus status = *show.status();
  EXPECT_EQ(std::ranges::count_if(status.notes,
                                  [](const std::string& note) {
                                    return note.find(
                                               "the probe's camera has refused an "
                                               "exposure: unwilling: it is busy") !=
                                           std::string::npos;
                                  }),
            1);
  EXPECT_EQ(status.probe.refusal, "unwilling: it is busy");
  const std::string figure = "\"refused\": " + std::to_string(status.probe.refused);
  EXPECT_THAT(show_figures(set, status, {}), HasSubstr(figure));
}

TEST_F(ShowNotes, RecordsAsFineAndAsSmallAsItsSetSays) {
  const auto sizes_of = [&](const std::string& more) {
    const std::filesystem::path video = dir_ / "take.mkv", frames = dir_ / "take";
    Show show(made_set("grey:4,25,0", "[record]\nfile = \"" + video.string() + "\"\nexr = \"" +
                                          frames.string() + "\"\n" + more));
    show.run();
    EXPECT_EQ(show.status()->recorder.written, 4);
    return std::pair(file_size(video), file_size(frames / "frame.000003.exr"));
  };
  const auto usual = sizes_of("");
  EXPECT_EQ(sizes_of("crf = 18\nexr_compression = \"none\"\n"), usual);
  const auto small = sizes_of("crf = 45\nexr_compression = \"zip\"\n");
  EXPECT_LT(small.first, usual.first);
  EXPECT_LT(small.second, usual.second);
}

TEST_F(ShowNotes, RecordsFromOneFrameToAnother) {
  ShowOptions options;
  options.frames = 12;
  Show show(made_set("grey:1,25,0"), options);
  RecordSettings record;
  record.exr = (dir_ / "take").string();
  show.run([&](const ShownFrame& shown) {
    if (shown.prepared.job.frame == 2) show.post(StartRecording{record});
    if (shown.prepared.job.frame == 6) show.post(StopRecording{});
  });
  EXPECT_FALSE(show.status()->recording);
  EXPECT_GE(show.status()->recorder.written, 3);
  EXPECT_LE(show.status()->recorder.written, 6);
  EXPECT_EQ(show.status()->recorder.error, "");
}

}  // namespace
}  // namespace studio::show_notes_test
