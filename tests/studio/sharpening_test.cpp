// Pictures that sharpen while nothing moves.
#include "studio/sharpening.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <string>
#include <utility>

#include "studio/show.h"
#include "tests/made_files.h"
#include "tests/studio/made_show.h"

namespace studio::sharpening_test {
namespace {

constexpr int none = render::KeptTransport::none;
constexpr std::size_t cells = 1200;

std::vector<int> as_kept(const std::vector<std::uint8_t>& stages) {
  return {stages.begin(), stages.end()};
}

// Of what a cell takes with one ray a pixel: at each stage.
constexpr std::array<double, render::refinement_stages> made_cost{1.0 / 64, 0.0625, 0.25, 1,
                                                                  1.1,      4,      16,   40};

// A machine on which every cell with one ray a pixel takes `cell_ms`, and the rest of a frame
// `rest_ms`.
struct MadeMachine {
  double cell_ms;
  std::vector<int> kept = std::vector<int>(cells, none);
  double rest_ms = 3;
  std::size_t person_begin = 0, person_end = 0;  // cells that show one
  double look_elsewhere_ms = 0;
  double look_ms = 0;  // for each of these, finished; in proportion to `look_cost`
  std::array<double, render::refinement_stages> look_cost{0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1, 1.2};
  std::size_t moving = 0;  // so many cells, the first ones, are lost in every frame
  // Every so many cells one takes so many times as long, finished; 0 = none does.
  std::size_t slow_every = 0;
  double slow = 1;
  int given_up = 0;
  int last = render::finished_stage;

  double ms_at(std::size_t stage) const { return cell_ms * made_cost[stage]; }
  std::vector<float> looks_ms() const {
    std::vector<float> looks(cells, static_cast<float>(look_elsewhere_ms));
    for (std::size_t i = person_begin; i < person_end; ++i) {
      if (kept[i] == none) continue;
      looks[i] += static_cast<float>(look_ms * look_cost[static_cast<std::size_t>(kept[i])]);
    }
    return looks;
  }
  double share_of_person() const {
    const auto sum = std::reduce(kept.begin() + static_cast<std::ptrdiff_t>(person_begin),
                                 kept.begin() + static_cast<std::ptrdiff_t>(person_end));
    return sum / static_cast<double>((person_end - person_begin) * render::finished_stage);
  }

  // Shows a frame; returns what it takes.
  double show(Sharpening& sharpening) {
    std::fill_n(kept.begin(), moving, none);
    SharpeningPlan& plan = sharpening.next(kept, looks_ms(), last);
    double ms = 0;
    std::size_t found = 0;
    std::vector<std::uint8_t> stages = plan.stages, ahead(cells);
    for (; found < plan.ahead.size() && ms < plan.ahead_ms; ++found) {
      render::Refinement& one = plan.ahead[found];
      const auto [cell, stage] = std::pair(one.cell, one.stage);
      EXPECT_LT(stages[cell], stage);
      EXPECT_EQ(kept[cell], stages[cell]);
      const bool is_slow =
          slow_every > 0 && cell % slow_every == 0 && stage == render::finished_stage;
      const double took_ms = ms_at(stage) * (is_slow ? slow : 1);
      one.given_up = took_ms > sharpening.most_of_cell_ms();
      one.took_ms = static_cast<float>(std::min(took_ms, sharpening.most_of_cell_ms()));
      ms += one.took_ms;
      given_up += one.given_up;
      if (one.given_up) continue;
      stages[cell] = stage;
      ahead[cell] = 1;
    }
    sharpening.found_ahead(stages, ms);
    double finding_ms = 0;
    for (std::size_t i = 0; i < cells; ++i) {
      if (kept[i] != stages[i] && !ahead[i]) finding_ms += ms_at(stages[i]);
    }
    kept = as_kept(stages);
    const std::vector<float> looked = looks_ms();
    const double frame_ms = rest_ms + finding_ms + std::reduce(looked.begin(), looked.end());
    sharpening.took(frame_ms, finding_ms, false);
    return ms + frame_ms;
  }
  // Shows so many; returns how many are late.
  int late_of(int frames, Sharpening& sharpening) {
    int late = 0;
    for (int i = 0; i < frames; ++i) late += show(sharpening) > 40;
    return late;
  }
};

// All cells are finished, and a person may come before some.
MadeMachine sharp_before_a_person(Sharpening& sharpening) {
  MadeMachine machine{0.1};
  machine.late_of(200, sharpening);
  machine.person_begin = 300, machine.person_end = 500;
  return machine;
}

TEST(Sharpening, IsDoneWithinASecondOfFrames) {
  Sharpening sharpening({25, 1}, false);
  std::vector<int> kept(cells, none);
  double before = -1;
  for (int i = 0; i < 26; ++i) {
    kept = as_kept(sharpening.next(kept).stages);
    sharpening.took(10, 0, false);
    if (i == 0) {
      EXPECT_EQ(kept, std::vector<int>(cells, render::one_ray_stage));
    }
    EXPECT_TRUE(sharpening.share() > before || before == 1);
    before = sharpening.share();
  }
  EXPECT_EQ(kept, std::vector<int>(cells, render::finished_stage));
  EXPECT_EQ(sharpening.share(), 1);
}

TEST(Sharpening, BeginsAgainOnlyWhereCellsWereLost) {
  Sharpening sharpening({25, 1}, false);
  std::vector<int> kept(cells, render::finished_stage);
  std::fill_n(kept.begin() + 300, 40, none);
  const auto stages = sharpening.next(kept).stages;
  for (std::size_t i = 0; i < cells; ++i) {
    EXPECT_EQ(stages[i], i >= 300 && i < 340 ? render::one_ray_stage : render::finished_stage) << i;
  }
}

TEST(Sharpening, SpreadsOverThePicture) {
  Sharpening sharpening({100, 1}, false);
  // 40 x 30
  const auto stages = sharpening.next(std::vector<int>(cells, render::one_ray_stage)).stages;
  std::array<int, 4> quarters{};
  int all = 0;
  for (std::size_t i = 0; i < cells; ++i) {
    const bool below = i / 40 >= 15, right = i % 40 >= 20;
    quarters[static_cast<std::size_t>(2 * below + right)] += stages[i] > render::one_ray_stage;
    all += stages[i] > render::one_ray_stage;
  }
  EXPECT_GT(all, 40);
  for (const int part : quarters) EXPECT_NEAR(part, all / 4.0, all / 10.0);
}

// A live show keeps to its time whatever a cell takes, and is sharp in the end.
TEST(Sharpening, KeepsToTheTimeOfALiveFrame) {
  for (const double coarse_ms : {5.0, 100.0}) {
    Sharpening sharpening({25, 1}, true);
    MadeMachine machine{coarse_ms / cells};
    int late = 0, frames = 0;
    for (; (sharpening.share() < 1 || frames == 0) && frames < 500; ++frames) {
      late += machine.show(sharpening) > 40 && frames > 0;
    }
    EXPECT_EQ(sharpening.share(), 1) << coarse_ms;
    EXPECT_EQ(late, 0) << coarse_ms;
    EXPECT_LT(frames, coarse_ms < 10 ? 20 : 150) << coarse_ms;
  }
}

// Persons are looked at in every frame, and finer cells would take the longer: where that takes all
// of the time, cells stay as they are. Without persons they go on.
TEST(Sharpening, LetsCellsBeWherePersonsTakeAllOfTheTime) {
  for (const bool persons : {false, true}) {
    Sharpening sharpening({25, 1}, true);
    MadeMachine machine{2};
    if (persons) machine.person_end = 100, machine.look_ms = 0.1;
    for (int i = 0; i < 3; ++i) machine.show(sharpening);
    machine.rest_ms = persons ? 33 : 38;
    for (int i = 0; i < 15; ++i) machine.show(sharpening);
    const double share = sharpening.share();
    for (int i = 0; i < 10; ++i) machine.show(sharpening);
    ASSERT_LT(share, 1);
    if (persons) {
      EXPECT_EQ(sharpening.share(), share);
    } else {
      EXPECT_GT(sharpening.share(), share);
    }
    machine.rest_ms = 3;
    for (int i = 0; i < 40; ++i) machine.show(sharpening);
    EXPECT_GT(sharpening.share(), share);
  }
}

// A person comes before sharp cells: frames are late for a moment, then coarser where the person
// is, and stay so; when the person has gone, they are sharp again. Whatever else moves a little.
TEST(Sharpening, GoesBackWherePersonsMakeFramesLate) {
  for (const std::size_t moving : {0U, 1U, 10U, 100U}) {
    Sharpening sharpening({25, 1}, true);
    MadeMachine machine{0.1};
    machine.moving = moving;
    machine.late_of(400, sharpening);
    const auto all_stand_finished = [&] {
      return std::all_of(machine.kept.begin() + static_cast<std::ptrdiff_t>(moving),
                         machine.kept.end(),
                         [](int stage) { return stage == render::finished_stage; });
    };
    ASSERT_TRUE(all_stand_finished()) << moving;
    machine.person_begin = 300, machine.person_end = 500;
    machine.look_ms = 0.35;
    const int late = machine.late_of(75, sharpening);
    EXPECT_LT(late, 50);
    EXPECT_GT(late, 0);
    EXPECT_EQ(machine.late_of(100, sharpening), 0);
    int changes = 0;
    for (int i = 0; i < 100; ++i) {
      const std::vector<int> before = machine.kept;
      EXPECT_LE(machine.show(sharpening), 40) << i;
      changes += machine.kept != before;
    }
    EXPECT_LT(changes, 10);
    EXPECT_LT(machine.share_of_person(), 1);
    EXPECT_GT(machine.share_of_person(), 0.3);
    for (std::size_t i = moving; i < cells; ++i) {
      if (i < 300 || i >= 500) {
        ASSERT_EQ(machine.kept[i], render::finished_stage) << i;
      }
    }
    machine.look_ms = 0;
    machine.late_of(300, sharpening);
    EXPECT_TRUE(all_stand_finished()) << moving;
  }
}

// A show that begins with a person: what does not show the person goes on, for it costs nothing
// later; however little looking takes elsewhere.
TEST(Sharpening, GoesOnWherePersonsAreNot) {
  Sharpening sharpening({25, 1}, true);
  MadeMachine machine{0.1};
  machine.person_begin = 300, machine.person_end = 500;
  machine.look_ms = 0.35;
  machine.look_elsewhere_ms = 1e-4;
  machine.late_of(600, sharpening);
  EXPECT_EQ(machine.late_of(100, sharpening), 0);
  const double all = sharpening.share() * cells;
  EXPECT_GT((all - machine.share_of_person() * 200) / (cells - 200), 0.7);
}

// Cells that change while time is short teach nothing wrong: when the person has gone, they have
// it.
TEST(Sharpening, KnowsWhatFindingTakesWhilePersonsMakeFramesLate) {
  Sharpening sharpening({25, 1}, true);
  MadeMachine machine = sharp_before_a_person(sharpening);
  machine.look_ms = 0.15;
  machine.late_of(50, sharpening);
  machine.look_ms = 0;
  for (const std::size_t moving : {300U, 900U}) {
    machine.moving = moving;
    machine.late_of(20, sharpening);
    EXPECT_EQ(machine.late_of(80, sharpening), 0) << moving;
  }
}

// Not where that helps nothing: looking takes next to nothing, or the same in coarse cells.
TEST(Sharpening, StaysWhereGoingBackWouldNotHelp) {
  Sharpening sharpening({25, 1}, true);
  MadeMachine machine = sharp_before_a_person(sharpening);
  machine.look_ms = 1e-3;
  machine.rest_ms = 42;
  machine.late_of(300, sharpening);
  EXPECT_EQ(machine.share_of_person(), 1);
  machine.look_ms = 0.2;
  machine.look_cost.fill(1);
  machine.rest_ms = 3;
  machine.late_of(600, sharpening);
  EXPECT_GT(machine.share_of_person(), 0.3);
}

// One frame that takes long is no reason.
TEST(Sharpening, StaysWhereOneFrameIsLate) {
  Sharpening sharpening({25, 1}, true);
  MadeMachine machine = sharp_before_a_person(sharpening);
  machine.look_ms = 0.05;
  machine.late_of(50, sharpening);
  for (const double rest_ms : {1000.0, 3.0}) {
    machine.rest_ms = rest_ms;
    machine.late_of(rest_ms > 3 ? 1 : 20, sharpening);
    EXPECT_EQ(machine.share_of_person(), 1);
  }
}

// Frames are late for looks and for other things: what can be had is, and it ends.
TEST(Sharpening, GoesBackNoFurtherThanHelps) {
  Sharpening sharpening({25, 1}, true);
  MadeMachine machine = sharp_before_a_person(sharpening);
  machine.look_ms = 0.1;
  machine.rest_ms = 60;
  machine.late_of(600, sharpening);
  const std::vector<int> before = machine.kept;
  machine.late_of(200, sharpening);
  EXPECT_EQ(machine.kept, before);
}

// What is lost and can be found anew in the time of a frame is as fine as before at once.
TEST(Sharpening, FindsAFewLostCellsFinishedAtOnce) {
  Sharpening sharpening({25, 1}, true);
  MadeMachine machine{0.02};
  for (int i = 0; i < 100; ++i) machine.show(sharpening);
  ASSERT_EQ(sharpening.share(), 1);
  std::fill_n(machine.kept.begin(), 20, none);
  machine.show(sharpening);
  EXPECT_EQ(sharpening.share(), 1);
  std::fill_n(machine.kept.begin(), 400, none);
  EXPECT_LE(machine.show(sharpening), 40);
  EXPECT_LT(sharpening.share(), 1);
}

// Where smooth edges can be had everywhere within a second, they come before all cells have a ray a
// pixel: those would take a good part of it.
TEST(Sharpening, HasEdgesWithinASecondWhereItCan) {
  for (const double coarse_ms : {30.0, 120.0, 600.0}) {
    Sharpening sharpening({25, 1}, true);
    MadeMachine machine{coarse_ms / cells};
    for (int i = 0; i < 400; ++i) machine.show(sharpening);
    std::ranges::fill(machine.kept, none);
    int frames = 0;
    while (std::ranges::min(machine.kept) < render::smoothed_stage && frames < 100) {
      machine.show(sharpening);
      ++frames;
    }
    EXPECT_LE(frames, 26) << coarse_ms;
  }
}

// While things move, what they leave as it is goes on, but no cell that takes longer than frames
// have; that is found once they stand.
TEST(Sharpening, LeavesSlowCellsUntilNothingMoves) {
  Sharpening sharpening({25, 1}, true);
  MadeMachine machine{0.1};
  machine.late_of(12, sharpening);
  machine.slow_every = 20, machine.slow = 30;  // 48 ms
  machine.moving = 40;
  const int late = machine.late_of(400, sharpening);
  EXPECT_LT(late, 10);
  const auto finished = [&] {
    return std::ranges::count(machine.kept, int{render::finished_stage});
  };
  EXPECT_GT(finished(), static_cast<std::ptrdiff_t>(cells - 200));
  EXPECT_LT(finished(), static_cast<std::ptrdiff_t>(cells - 50));
  EXPECT_EQ(sharpening.why_coarse(), "");
  machine.moving = 0;
  machine.late_of(200, sharpening);
  EXPECT_EQ(machine.kept, std::vector<int>(cells, render::finished_stage));
}

// What stands still is found beyond the effort, as long as frames have time left by far; as sharp
// as asked it is all the while.
TEST(Sharpening, GoesBeyondTheEffortWhereThereIsTime) {
  Sharpening sharpening({25, 1}, true);
  MadeMachine machine{0.1};
  machine.last = render::finer_stage;
  EXPECT_LT(machine.late_of(1000, sharpening), 5);
  EXPECT_EQ(machine.kept, std::vector<int>(cells, render::finer_stage));
  EXPECT_EQ(sharpening.share(), 1);
  EXPECT_EQ(sharpening.why_coarse(), "");
  // What moves begins again, and nothing else goes beyond meanwhile.
  std::fill_n(machine.kept.begin(), 600, int{render::finished_stage});
  machine.moving = 40;
  machine.late_of(100, sharpening);
  EXPECT_EQ(std::ranges::count(machine.kept, int{render::finer_stage}), 600);
}

TEST(Sharpening, StaysAtTheEffortWhereFramesAreBusy) {
  Sharpening sharpening({25, 1}, true);
  MadeMachine machine{0.1};
  machine.last = render::finer_stage;
  machine.rest_ms = 24;
  machine.late_of(1000, sharpening);
  EXPECT_EQ(machine.kept, std::vector<int>(cells, render::finished_stage));
}

// Cells that would take seconds to be finished are told, whatever the others do beyond that.
TEST(Sharpening, TellsOfSlowCellsWhileOthersGoBeyond) {
  Sharpening sharpening({25, 1}, true);
  MadeMachine machine{0.1};
  machine.last = render::finer_stage;
  machine.slow_every = 20, machine.slow = 2000;
  std::string why;
  for (int i = 0; i < 1500 && why.empty(); ++i) {
    machine.show(sharpening);
    why = sharpening.why_coarse();
  }
  EXPECT_THAT(why, testing::HasSubstr("5.0 % of the picture"));
  EXPECT_LT(std::ranges::count(machine.kept, int{render::finer_stage}), 1140);
}

// Pictures that do not depend on time stay at what the effort asks.
TEST(Sharpening, StaysAtTheEffortWhereNothingIsLive) {
  Sharpening sharpening({25, 1}, false);
  MadeMachine machine{0.1};
  machine.last = render::finer_stage;
  for (int i = 0; i < 60; ++i) machine.show(sharpening);
  EXPECT_EQ(machine.kept, std::vector<int>(cells, render::finished_stage));
}

// One cell in twenty would take seconds: none is waited for longer than three frames, hardly any
// twice, all others are finished, and what stays is told.
TEST(Sharpening, WaitsForNoCellThatWouldHoldFramesUp) {
  Sharpening sharpening({25, 1}, true);
  MadeMachine machine{0.1};
  machine.slow_every = 20, machine.slow = 2000;
  double longest_ms = 0;
  std::string why;
  for (int i = 0; i < 1500; ++i) {
    longest_ms = std::max(longest_ms, machine.show(sharpening));
    why = sharpening.why_coarse();
    if (!why.empty()) break;
  }
  EXPECT_LT(longest_ms, 4 * 40);
  EXPECT_LE(machine.given_up, static_cast<int>(cells / 20 + 1));
  EXPECT_THAT(why, testing::HasSubstr("5.0 % of the picture"));
  for (std::size_t i = 0; i < cells; ++i) {
    EXPECT_EQ(machine.kept[i] == render::finished_stage, i % 20 != 0) << i;
    EXPECT_GE(machine.kept[i], render::smoothed_stage);
  }
  // What moves there may be quicker.
  std::ranges::fill(machine.kept, none);
  machine.slow = 1;
  machine.late_of(1500, sharpening);
  EXPECT_EQ(machine.kept, std::vector<int>(cells, render::finished_stage));
  EXPECT_EQ(sharpening.why_coarse(), "");
}

TEST(Sharpening, StaysWhereTheMemoryEnds) {
  Sharpening sharpening({25, 1}, false);
  std::vector<int> kept(cells, none);
  double last = 0;
  for (int i = 0; i < 30; ++i) {
    const auto now = sharpening.next(kept).stages;
    const bool full = sharpening.share() > 0.65;
    sharpening.took(10, 0, full);
    kept = as_kept(now);
    if (i > 20) {
      EXPECT_EQ(sharpening.share(), last);
    }
    EXPECT_EQ(!sharpening.why_coarse().empty(), full) << i;
    last = sharpening.share();
  }
  EXPECT_LT(last, 0.7);
  EXPECT_GT(last, 0.6);
}

using SharpeningShow = MadeShowTest;

// What is moved shows in the very next frame, coarse; a second later the picture is as sharp as the
// effort asks.
TEST_F(SharpeningShow, ShowsAMoveAtOnceAndIsSharpASecondLater) {
  Set set = made_set("grey:60,25,0");
  const auto pictures_of = [&](bool sharpen) {
    set.show.sharpen = sharpen;
    Show show(set);
    std::vector<std::vector<capture::Half>> pictures;
    std::vector<double> sharpness;
    show.run([&](const ShownFrame& shown) {
      pictures.push_back(shown.result->rgba.pixels);
      sharpness.push_back(show.status()->sharpness);
      if (pictures.size() == 28) show.post(MoveObject{"cube", {{0.5, 0, 0}, 30, 0, 1}});
    });
    return std::pair(pictures, sharpness);
  };
  const auto [sharp, _] = pictures_of(false);
  const auto [pictures, sharpness] = pictures_of(true);
  ASSERT_EQ(pictures.size(), 60U);
  EXPECT_LT(sharpness[0], 0.7);
  EXPECT_NE(pictures[0], sharp[0]);
  EXPECT_EQ(sharpness[26], 1);
  EXPECT_EQ(pictures[26], sharp[26]);
  // The next frame whose inputs are made after the command, one or two later.
  std::size_t moved = 28;
  while (moved < 60 && sharpness[moved] == 1) ++moved;
  EXPECT_LE(moved, 31U);
  EXPECT_NE(pictures[moved], sharp[moved]);
  ASSERT_LT(moved + 25, 60U);
  EXPECT_EQ(sharpness[moved + 25], 1);
  EXPECT_EQ(pictures[moved + 25], sharp[moved + 25]);
}

}  // namespace
}  // namespace studio::sharpening_test
