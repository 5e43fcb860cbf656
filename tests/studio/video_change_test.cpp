// Videos that are switched on air, beside edits of the set or without.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/studio/edited_show.h"

namespace studio::video_change_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using VideoChangeTest = EditedShowTest;

const std::string news =
    "[[object]]\nname = \"set\"\nmade = \"tv\"\n"
    "[[video]]\nname = \"news\"\nsource = \"grey:1,25,0\"\nobject = \"set/tv\"\n";

TEST_F(VideoChangeTest, AVideoThatIsSwitchedWhileAnEditIsReadStaysOpen) {
  FrameMaker maker(made_set("grey:1,25,0", news));
  std::int64_t n = 0;
  ASSERT_TRUE(maker.make(n++));
  opening.shut();
  maker.change_set_beside(
      made_set("grey:1,25,0", news + "[[billboard]]\nsource = \"late:9\"\n" + placed));
  maker.change_video("news", "sole:0");
  EXPECT_EQ(maker.set().videos.at(0).source, "sole:0") << "at once";
  ASSERT_TRUE(maker.make(n++));
  EXPECT_FALSE(opening.overdue());
  opening.open();
  const auto notes = make_until(maker, n, [](const auto& frame) { return !frame.persons.empty(); });
  EXPECT_THAT(notes, testing::Each(testing::Not(HasSubstr("busy"))));
  EXPECT_EQ(maker.set().videos.at(0).source, "sole:0");
  EXPECT_EQ(open_now, 1);
  EXPECT_EQ(opened, 1);
}

// Of shows that are live.
TEST_F(VideoChangeTest, NoFrameWaitsForAVideosNewSource) {
  ShowOptions options;
  options.live = true;
  options.frames = 1000;
  Show show(made_set("grey:1,25,0", news), options);
  opening.shut();
  int n = 0;
  bool was_changing = false;
  show.run([&](const ShownFrame&) {
    if (++n == 3) show.post(SetVideo{"news", "late:9"});
    was_changing = was_changing || show.status()->changing;
    if (n == 10) opening.open();
    if (n > 10 && !show.status()->changing) show.post(Quit{});
  });
  EXPECT_FALSE(opening.overdue());
  EXPECT_TRUE(was_changing);
  EXPECT_THAT(show.status()->notes, IsEmpty());
}

TEST_F(VideoChangeTest, AVideoStaysUntilItsNewSourceIsOpenAndWhereItCannotBe) {
  FrameMaker maker(made_set("grey:1,25,0", news));
  std::int64_t n = 0;
  const auto source = [&] { return maker.set().videos.at(0).source; };
  const auto is_done = [&](const auto&) { return !maker.is_changing(); };
  ASSERT_TRUE(maker.make(n++));
  opening.shut();
  maker.change_video_beside("news", "held:0");
  maker.change_video_beside("news", "nowhere:");  // passed over
  maker.change_video_beside("news", "sole:0");    // waits for that to be closed
  ASSERT_TRUE(maker.make(n++));
  EXPECT_EQ(source(), "grey:1,25,0");
  opening.open();
  EXPECT_THAT(make_until(maker, n, is_done), IsEmpty());
  EXPECT_EQ(source(), "sole:0");
  EXPECT_EQ(open_now, 1);
  maker.change_video_beside("news", "nowhere:");
  EXPECT_THAT(make_until(maker, n, is_done), ElementsAre(HasSubstr("nowhere")));
  EXPECT_EQ(source(), "sole:0");
  EXPECT_THROW(maker.change_video_beside("old news", "sole:0"), std::invalid_argument);
}

TEST_F(VideoChangeTest, AnEditAfterAVideoThatIsBeingOpenedHasIt) {
  FrameMaker maker(made_set("grey:1,25,0", news));
  std::int64_t n = 0;
  ASSERT_TRUE(maker.make(n++));
  std::string held = news;
  held.replace(held.find("grey:1,25,0"), 11, "held:0");
  opening.shut();
  maker.change_video_beside("news", "held:0");
  maker.change_set_beside(
      made_set("grey:1,25,0", held + "[[object]]\nname = \"more\"\nmade = \"desk\"\n"));
  maker.move_object("more", {{0, 5, 0}, 0, 0, 1});  // which only the edit has
  ASSERT_TRUE(maker.make(n++));
  EXPECT_FALSE(opening.overdue());
  opening.open();
  EXPECT_THAT(make_until(maker, n, [&](const auto&) { return !maker.is_changing(); }), IsEmpty());
  EXPECT_EQ(maker.set().objects.back().pose.position.y, 5);
  EXPECT_EQ(maker.set().videos.at(0).source, "held:0");
  EXPECT_EQ(opened, 1);
}

// The switch is newer than the edit's file, whichever is there first.
TEST_F(VideoChangeTest, AVideoThatIsBeingOpenedWhenAnEditIsThereComesAfterIt) {
  FrameMaker maker(made_set("grey:1,25,0", news));
  std::int64_t n = 0;
  ASSERT_TRUE(maker.make(n++));
  maker.change_set_beside(made_set("grey:1,25,0", news + "loop = true\n"));
  opening.shut();
  maker.change_video_beside("news", "held:0");
  make_until(maker, n, [&](const auto&) { return maker.set().videos.at(0).loop; });
  EXPECT_EQ(maker.set().videos.at(0).source, "grey:1,25,0");
  opening.open();
  EXPECT_THAT(make_until(maker, n, [&](const auto&) { return !maker.is_changing(); }), IsEmpty());
  EXPECT_EQ(maker.set().videos.at(0).source, "held:0");
  EXPECT_EQ(open_now, 1);
}

// A camera that can be opened only once is the plate and on a screen.
TEST_F(VideoChangeTest, ALivePlatesCameraIsShownAsThePlate) {
  FrameMaker maker(made_set("live_grey:1000,100", news));
  const auto shown_at = [&](std::int64_t frame) {
    const auto made = maker.make(frame);
    const capture::HalfImage& plate = *made->plate;
    return std::pair(made->videos.at(0)->levels.front().at(0, 0, 0),
                     capture::float_from_half(plate.pixels[plate.index(0, 0, 0)]));
  };
  shown_at(0);
  maker.change_video("news", "live_grey:1000,100");
  for (std::int64_t n = 1; n < 5; ++n) {
    const auto [video, plate] = shown_at(n);
    EXPECT_NEAR(video, plate, 1e-3F) << n;
  }
  maker.change_video("news", "grey:1,25,0");
  EXPECT_NEAR(shown_at(6).first, 0.1F, 1e-3F);
}

}  // namespace
}  // namespace studio::video_change_test
