// Files of straight lines.
#include "calibrate/line_marks.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/made_files.h"

namespace calibrate::line_marks_test {
namespace {

TEST(ReadLineMarks, ReadsWhatIsWritten) {
  const std::string path = made::make_temporary_directory() / "lines.toml";
  std::ofstream(path) << R"(width = 640
height = 480
centre = [320.5, 239]
max_angle = 90
[[line]]
name = "door"
parallel = "vertical"
pixels = [[1, 2], [3.5, 40], [5, 80]]
[[line]]
name = "window"
parallel = "vertical"
pixels = [[101, 2], [103.5, 40], [105, 80]]
[[line]]
name = "desk"
pixels = [[1, 200], [100, 210], [200, 200]]
[[rectangle]]
name = "gap"
across = "vertical"
lines = ["door", "desk", "window", "desk"]
)";
  const LineMarks marks = read_line_marks(path);
  EXPECT_EQ(marks.width, 640);
  EXPECT_EQ(marks.height, 480);
  EXPECT_EQ(marks.centre, (Vec2{320.5, 239}));
  EXPECT_NEAR(marks.max_angle_rad.value(), std::numbers::pi / 2, 1e-12);
  ASSERT_EQ(marks.lines.size(), 3U);
  EXPECT_EQ(marks.lines[1].name, "window");
  EXPECT_EQ(marks.lines[1].parallel, "vertical");
  EXPECT_EQ(marks.lines[1].pixels[1], (Vec2{103.5, 40}));
  EXPECT_EQ(marks.lines[2].parallel, "");
  ASSERT_EQ(marks.rectangles.size(), 1U);
  EXPECT_EQ(marks.rectangles[0].sides, (std::array<std::size_t, 4>{0, 2, 1, 2}));
  EXPECT_EQ(marks.rectangles[0].across, "vertical");
}

TEST(ReadLineMarks, RefusesEveryBadFileWithPlaceAndReason) {
  made::expect_refusals(
      "lines_", ".toml",
      {{"lines_empty.toml", "this table has no \"width\""},
       {"lines_syntax.toml", ":1:"},
       {"lines_no_width.toml", "this table has no \"width\""},
       {"lines_size_with_fraction.toml", ":1:9: \"width\" must be a whole number"},
       {"lines_no_line.toml", ": no straight line is marked"},
       {"lines_unknown_key.toml", ":5:1: unknown key \"points\""},
       {"lines_two_pixels.toml", ":5:10: \"pixels\" must be a list of three or more"},
       {"lines_three_coordinates.toml", ":5:19: \"pixels\" must be a list of 2 numbers"},
       {"lines_nan.toml", ":5:24: \"pixels\" must hold numbers"},
       {"lines_name_twice.toml", ":6:1: line \"a\" is here for the second time"},
       {"lines_one_place.toml", ": line \"a\" is shorter than 5 px"},
       {"lines_alone_in_its_direction.toml", ": line \"a\" is the only one that is \"up\""},
       {"lines_angle_of_zero.toml", ":3:13: \"max_angle\" must be above 0"},
       {"lines_rectangle_of_three.toml", ":8:9: \"lines\" must be the names of four lines"},
       {"lines_rectangle_of_no_line.toml", ":8:15: there is no line \"b\""},
       {"lines_rectangle_across_nothing.toml", ":9:10: no line is \"parallel\" to \"up\""}},
      read_line_marks);
}

}  // namespace
}  // namespace calibrate::line_marks_test
