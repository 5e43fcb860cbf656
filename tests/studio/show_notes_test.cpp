// What a show tells, and its takes: started, stopped, refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

#include "studio/show.h"
#include "tests/studio/made_show.h"

namespace studio::show_notes_test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

using ShowNotes = MadeShowTest;

TEST_F(ShowNotes, NotesAPlateThatEndsEarly) {
  ShowOptions options;
  options.frames = 9;
  Show show(made_set("grey:4,25,0"), options);
  show.run();
  EXPECT_THAT(show.status()->notes, Contains(HasSubstr("ended after 4 of 9 frames")));
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

TEST_F(ShowNotes, NotesThatTheCamerasTrackHasEnded) {
  std::ofstream(dir_ / "track.csv") << "time_s,px,py,pz,qw,qx,qy,qz\n"
                                       "0,0,-8,4,0.7,-0.7,0,0\n0.1,0,-8,4,0.7,-0.7,0,0\n";
  Set set = made_set("grey:9,25,0");
  set.camera.pose.track = (dir_ / "track.csv").string();
  Show show(set);
  show.run();
  EXPECT_THAT(show.status()->notes, ElementsAre(HasSubstr("no pose at 0.120 s")));
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

// What is told of every frame does not hide what is told once.
TEST_F(ShowNotes, KeepsNotesOfEveryKind) {
  Show show(
      made_set("grey:60,25,2",
               "[[billboard]]\nsource = \"grey:3,25,0\"\nheight = 2\nposition = [0, 0, 0]\n"));
  show.run();
  EXPECT_THAT(show.status()->notes, Contains(HasSubstr("has ended")));
  EXPECT_THAT(show.status()->notes, Contains(HasSubstr("the plate's frame")));
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
