// Fish-eyes from straight lines.
#include "calibrate/line_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "calibrate/grey_picture.h"
#include "calibrate/pose.h"
#include "capture/camera.h"
#include "tests/calibrate/made_markers.h"
#include "tests/made_files.h"

namespace calibrate::line_fit_test {
namespace {

using made::degree;
using testing::HasSubstr;

Lens made_equisolid() { return {"equisolid", 1400, 1000, {310, 705.3, 492.8}, 93 * degree}; }
Lens made_equidistant() {
  return {"kannala_brandt", 1400, 1000, {290, 290, 705.3, 492.8}, 93 * degree};
}

// A piece of a line through `p` along `d`, camera's frame, by marks with noise; nothing if too
// little of it is seen.
std::optional<MarkedLine> marked(
    const Lens& lens, Vec3 p, Vec3 d, double half_length, double noise_px, made::Random& random) {
  MarkedLine line;
  for (int i = 0; i <= 12; ++i) {
    const auto q = project(lens, p + d * (half_length * (i / 6.0 - 1)));
    if (q)
      line.pixels.push_back({q->x + noise_px * random.normal(), q->y + noise_px * random.normal()});
  }
  if (line.pixels.size() < 6) return std::nullopt;
  const Vec2 a = line.pixels.front(), b = line.pixels.back();
  if (hypotenuse(a.x - b.x, a.y - b.y) < 100) return std::nullopt;
  return line;
}

// A room around the camera: verticals that lean by `lean_rad`, and lines of any direction.
LineMarks made_room(const Lens& lens,
                    Vec3 down,
                    std::size_t verticals,
                    std::size_t others,
                    double noise_px,
                    double lean_rad,
                    unsigned seed) {
  made::Random random(seed);
  LineMarks marks{lens.width, lens.height, Vec2{705.3, 492.8}, lens.max_angle_rad, {}, {}};
  while (marks.lines.size() < verticals + others) {
    const bool vertical = marks.lines.size() < verticals;
    Vec3 p = random.direction() * random.uniform(1, 3);
    p.z = std::abs(p.z);
    const Vec3 d = vertical ? normalize(down + random.direction() * lean_rad) : random.direction();
    auto line = marked(lens, p, d, 1.2, noise_px, random);
    if (!line) continue;
    line->name = "line " + std::to_string(marks.lines.size());
    if (vertical) line->parallel = "vertical";
    marks.lines.push_back(*line);
  }
  return marks;
}

TEST(FitLensToLines, FindsTheFocalLengthWithinItsUncertainty) {
  const Vec3 down = normalize(Vec3{-0.05, 1, 0.02});
  double squares = 0;
  constexpr unsigned rooms = 20;
  for (unsigned seed = 0; seed < rooms; ++seed) {
    const bool equisolid = seed % 2 == 0;
    const Lens lens = equisolid ? made_equisolid() : made_equidistant();
    const LineMarks marks = made_room(lens, down, 4, 8, 0.5, 0.2 * degree, seed);
    LineFitOptions options;
    options.law = equisolid ? FisheyeLaw::equisolid : FisheyeLaw::equidistant;
    const LineFit fit = fit_lens_to_lines(marks, options);
    EXPECT_EQ(fit.lens.model, lens.model);
    EXPECT_EQ(fit.lens.max_angle_rad, lens.max_angle_rad);
    const double off = fit.lens.parameters[0] - lens.parameters[0];
    EXPECT_LT(std::abs(off), 4.5 * fit.focal_sigma_px) << seed;
    EXPECT_LT(fit.focal_sigma_px, 0.01 * lens.parameters[0]) << seed;
    squares += off * off / (fit.focal_sigma_px * fit.focal_sigma_px);
    ASSERT_EQ(fit.parallels.size(), 1U);
    EXPECT_LT(length(cross(fit.parallels[0].direction_cam, down)), 1 * degree) << seed;
    EXPECT_NEAR(fit.rms_px, 0.45, 0.12);
  }
  EXPECT_GT(squares / rooms, 0.3);
  EXPECT_LT(squares / rooms, 2.0);
}

TEST(FitLensToLines, KnowsHowRightItIsFromMarksWorseThanExpected) {
  double squares = 0;
  constexpr unsigned rooms = 16;
  for (unsigned seed = 0; seed < rooms; ++seed) {
    const LineMarks marks = made_room(made_equisolid(), {0, 1, 0}, 4, 8, 2, 0.2 * degree, seed);
    const LineFit fit = fit_lens_to_lines(marks);
    const double off = fit.lens.parameters[0] - 310;
    squares += off * off / (fit.focal_sigma_px * fit.focal_sigma_px);
    EXPECT_LT(fit.focal_sigma_px, 12) << seed;
  }
  EXPECT_GT(squares / rooms, 0.3);
  EXPECT_LT(squares / rooms, 2.2);
}

TEST(FitLensToLines, TellsWhatTheOtherLawMakesOfTheLines) {
  // Of many long lines the law is told; of one that is not the lens's it is said.
  const LineMarks many = made_room(made_equidistant(), {0, 1, 0}, 6, 12, 0.2, 0.1 * degree, 2);
  LineFitOptions options;
  options.noise_px = 0.2;
  const LineFit wrong = fit_lens_to_lines(many, options);
  ASSERT_TRUE(wrong.other);
  EXPECT_EQ(wrong.other->lens.model, "kannala_brandt");
  EXPECT_LT(wrong.other->against, -9);
  EXPECT_LT(wrong.other->rms_px, wrong.rms_px);
  const auto truth = distance_between(
      wrong.lens, made_equidistant(),
      std::vector<Vec2>{
          {300, 300}, {700, 500}, {1100, 300}, {1100, 700}, {300, 700}, {700, 150}, {700, 850}});
  EXPECT_GT(wrong.lens.error_px, 0.5 * truth.value().axis_px);
  options.law = FisheyeLaw::equidistant;
  const LineFit right = fit_lens_to_lines(many, options);
  ASSERT_TRUE(right.other);
  EXPECT_FALSE(right.other->undecided());
  EXPECT_GT(right.other->against, 9);
  EXPECT_LT(right.lens.error_px, 0.5 * wrong.lens.error_px);
  // Of short ones near the middle it is not, and the lens may be off by as much as both differ.
  Lens narrow = made_equidistant();
  narrow.max_angle_rad = 50 * degree;
  const LineMarks few = made_room(narrow, {0, 1, 0}, 4, 4, 0.5, 0.1 * degree, 4);
  const LineFit open = fit_lens_to_lines(few);
  ASSERT_TRUE(open.other);
  EXPECT_TRUE(open.other->undecided());
  EXPECT_GT(open.lens.error_px, 0.3 * open.other->distance.axis_px);
}

// Straight whatever the lens: all lie in planes through the axis.
TEST(FitLensToLines, RefusesLinesThroughTheMiddle) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    for (const std::size_t count : {3U, 6U}) {
      made::Random random(seed);
      LineMarks marks = made_room(made_equisolid(), {0, 1, 0}, 0, 1, 0.3, 0, seed);
      marks.lines.clear();
      for (std::size_t i = 0; i < count; ++i) {
        const double turn = std::numbers::pi * (static_cast<double>(i) + random.uniform(0, 0.5)) /
                            static_cast<double>(count);
        MarkedLine line;
        line.name = std::to_string(i);
        for (int k = -6; k <= 6; ++k) {
          line.pixels.push_back({705.3 + 70 * k * std::cos(turn) + 0.5 * random.normal(),
                                 492.8 + 70 * k * std::sin(turn) + 0.5 * random.normal()});
        }
        marks.lines.push_back(line);
      }
      EXPECT_THROW(fit_lens_to_lines(marks, {}), std::runtime_error) << seed << ' ' << count;
    }
  }
}

TEST(FitLensToLines, FindsTheCentreTooIfItIsFree) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    LineMarks marks = made_room(made_equisolid(), {0, 1, 0}, 4, 14, 0.3, 0, seed);
    marks.centre.reset();  // begins in the picture's middle, 10 px off
    LineFitOptions options;
    options.free_centre = true;
    const LineFit fit = fit_lens_to_lines(marks, options);
    EXPECT_LT(std::abs(fit.lens.parameters[0] - 310), 4.5 * fit.focal_sigma_px) << seed;
    EXPECT_LT(std::abs(fit.lens.parameters[1] - 705.3), 4.5 * fit.centre_sigma_px.x) << seed;
    EXPECT_LT(std::abs(fit.lens.parameters[2] - 492.8), 4.5 * fit.centre_sigma_px.y) << seed;
    EXPECT_LT(fit.centre_sigma_px.x, 4);
  }
}

TEST(FitLensToLines, KeepsAWrongMarkFromBendingTheLens) {
  LineMarks marks = made_room(made_equisolid(), {0, 1, 0}, 4, 8, 0.3, 0, 3);
  marks.lines[6].pixels[5].x += 25;
  marks.lines[6].pixels[5].y += 25;
  const LineFit fit = fit_lens_to_lines(marks);
  EXPECT_NEAR(fit.lens.parameters[0], 310, 2);
  EXPECT_GT(fit.lines[6].worst_px, 10);
  EXPECT_LT(fit.lines[7].worst_px, 2);
}

TEST(FitLensToLines, TellsALineThatIsNotStraightByHoldingItOut) {
  LineMarks marks = made_room(made_equisolid(), {0, 1, 0}, 4, 8, 0.3, 0, 4);
  const LineFit before = fit_lens_to_lines(marks);
  EXPECT_LT(before.lines[5].heldout_px, 1);
  const Vec2 a = marks.lines[5].pixels.front();
  const Vec2 b = marks.lines[5].pixels.back();
  const double size = hypotenuse(b.x - a.x, b.y - a.y);
  const auto count = static_cast<double>(marks.lines[5].pixels.size() - 1);
  for (std::size_t i = 0; i < marks.lines[5].pixels.size(); ++i) {
    const double bend = 8 * std::sin(std::numbers::pi * static_cast<double>(i) / count);
    marks.lines[5].pixels[i].x -= bend * (b.y - a.y) / size;
    marks.lines[5].pixels[i].y += bend * (b.x - a.x) / size;
  }
  const LineFit after = fit_lens_to_lines(marks);
  EXPECT_GT(after.lines[5].heldout_px, 1.5);
  EXPECT_NEAR(after.lens.parameters[0], 310, 3);
}

TEST(FitLensToLines, TakesParallelsThroughTheCentreButNoOthers) {
  // Straight in the picture whatever the focal length is.
  const Lens lens = made_equisolid();
  const auto radial = [&](double around) {
    MarkedLine line{"radial " + std::to_string(around), "", {}};
    for (double r = 20; r < 400; r += 30) {
      line.pixels.push_back({705.3 + r * std::cos(around), 492.8 + r * std::sin(around)});
    }
    return line;
  };
  LineMarks marks{1400, 1000, Vec2{705.3, 492.8}, {}, {}, {}};
  for (const double around : {0.1, 1.3, 2.2, 4.0}) marks.lines.push_back(radial(around));
  try {
    fit_lens_to_lines(marks);
    ADD_FAILURE() << "told a focal length";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("far from the picture's middle"));
  }
  const LineMarks room = made_room(lens, {0, 1, 0}, 3, 0, 0.2, 0, 5);
  for (const MarkedLine& line : room.lines) marks.lines.push_back(line);
  EXPECT_NEAR(fit_lens_to_lines(marks).lens.parameters[0], 310, 4);
}

TEST(FitLensToLines, RefusesMarksThatAreNone) {
  LineMarks marks = made_room(made_equisolid(), {0, 1, 0}, 2, 3, 0.2, 0, 5);
  marks.lines[0].pixels[0].x = NAN;
  EXPECT_THROW(fit_lens_to_lines(marks), std::invalid_argument);
  marks.lines.clear();
  EXPECT_THROW(fit_lens_to_lines(marks), std::invalid_argument);
}

TEST(RectangleOf, TellsTheShapeSeenFromAnywhere) {
  made::Random random(7);
  for (int i = 0; i < 50; ++i) {
    const double aspect = random.uniform(0.3, 3);
    const Pose pose = made::random_pose(random);
    const Pose cam_from_set{pose.R, Vec3{random.normal(), random.normal(), random.normal() + 4}};
    const std::array<Vec3, 4> corners{cam_from_set * Vec3{aspect, 0, 0},
                                      cam_from_set * Vec3{aspect, 1, 0},
                                      cam_from_set * Vec3{0, 1, 0}, cam_from_set * Vec3{}};
    std::array<Vec3, 4> sides;
    for (std::size_t k = 0; k < 4; ++k) {
      sides[k] = normalize(cross(corners[(k + 3) % 4], corners[k]));
    }
    for (const auto& normal :
         {std::optional<Vec3>{}, std::optional(cam_from_set.R * Vec3{0, 0, 1})}) {
      const auto found = rectangle_of(sides, normal);
      ASSERT_TRUE(found);
      EXPECT_NEAR(found->aspect, aspect, 1e-6);
      EXPECT_NEAR(found->off_square_rad, 0, 1e-6);
      EXPECT_NEAR(std::abs(dot(found->normal_cam, cam_from_set.R * Vec3{0, 0, 1})), 1, 1e-9);
    }
  }
  EXPECT_FALSE(rectangle_of({Vec3{1, 0, 0}, Vec3{1, 0, 0}, Vec3{1, 0, 0}, Vec3{1, 0, 0}}));
}

// A desk in an office, without a board: verticals of windows, wall and cupboards, and a keyboard
// that is 2.77 as long as deep, as it lies.
TEST(FitLensToLines, CalibratesTheDeskPictureByItsStraightLines) {
  const LineMarks marks = read_line_marks(PLATELIGHT_SOURCE_DIR "/tests/data/desk_lines.toml");
  const LineFit fit = fit_lens_to_lines(marks);
  EXPECT_NEAR(fit.lens.parameters[0], 622.4, 0.025 * 622.4);
  EXPECT_LT(fit.focal_sigma_px, 3);
  EXPECT_LT(fit.rms_px, 0.6);
  ASSERT_EQ(fit.parallels[0].name, "vertical");
  EXPECT_EQ(fit.parallels[0].lines, 8U);
  EXPECT_LT(fit.parallels[0].rms_rad, 0.5 * degree);
  // The camera was held level.
  EXPECT_LT(length(fit.parallels[0].direction_cam - Vec3{-0.0453, 0.9990, -0.0042}), 0.5 * degree);
  ASSERT_EQ(fit.rectangles.size(), 1U);
  EXPECT_NEAR(fit.rectangles[0].aspect, 2.77, 0.03);
  for (std::size_t i = 0; i < marks.lines.size(); ++i) {
    const LineReport& line = fit.lines[i];
    if (marks.lines[i].name.starts_with("keyboard")) {
      EXPECT_LT(line.worst_px, 1.5) << marks.lines[i].name;
      EXPECT_LT(line.rms_px, 0.6) << marks.lines[i].name;
    }
    // No line owes its straightness, or its direction, to itself.
    EXPECT_LT(line.heldout_px, 1.2) << marks.lines[i].name;
    if (marks.lines[i].parallel == "vertical") {
      EXPECT_LT(line.heldout_parallel_rad, 0.8 * degree) << marks.lines[i].name;
    }
  }
}

TEST(ReadLineMarks, HasTheDesksLinesWhereItsPictureIsSteepest) {
  const auto file = made::real_data() / "brackets/fisheye8mm/IMG_6963.JPG";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no " << file;
  const GreyPicture picture = grey_picture(*capture::open_camera(file.string(), {})->next()->image);
  const LineMarks marks = read_line_marks(PLATELIGHT_SOURCE_DIR "/tests/data/desk_lines.toml");
  ASSERT_EQ(picture.width, marks.width);
  ASSERT_EQ(picture.height, marks.height);
  std::size_t on_edges = 0;
  for (const MarkedLine& line : marks.lines) {
    // How steep the picture is across the line, this many pixels beside it.
    const auto steepness = [&](double beside) {
      double sum = 0;
      for (std::size_t i = 0; i < line.pixels.size(); ++i) {
        const Vec2 a = line.pixels[i == 0 ? 0 : i - 1];
        const Vec2 b = line.pixels[std::min(i + 1, line.pixels.size() - 1)];
        const double size = hypotenuse(b.x - a.x, b.y - a.y);
        const Vec2 across{(a.y - b.y) / size, (b.x - a.x) / size};
        const auto at = [&](double off) {
          return value_at(picture,
                          {line.pixels[i].x + off * across.x, line.pixels[i].y + off * across.y});
        };
        sum += at(beside + 2) - at(beside - 2);
      }
      return std::abs(sum);
    };
    if (steepness(0) > std::max(steepness(-6), steepness(6))) ++on_edges;
  }
  // The whiteboard's frame and the keyboard's front have a steeper neighbour.
  EXPECT_GE(on_edges, marks.lines.size() - 2);
}

}  // namespace
}  // namespace calibrate::line_fit_test
