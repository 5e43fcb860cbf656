// Files of markers, and what becomes of them.
#include "calibrate/markers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "calibrate/registration.h"
#include "tests/calibrate/made_markers.h"
#include "tests/made_files.h"

namespace calibrate::markers_test {
namespace {

using testing::HasSubstr;

std::string write(const std::string& text) {
  const std::string path = made::make_temporary_directory() / "markers.toml";
  std::ofstream(path) << text;
  return path;
}

TEST(ReadMarkers, ReadsWhatIsWritten) {
  const std::vector<Marker> markers = read_markers(
      write("[[marker]]\nname = \"door\"\nposition = [3.2, -5.01, 0]\npixel = [812.4, 1003.1]\n"
            "[[marker]]\nname = \"lamp\"\nposition = [1, 2, 3]\npixel = [-0.5, 7]\n"));
  ASSERT_EQ(markers.size(), 2U);
  EXPECT_EQ(markers[0], (Marker{"door", {3.2, -5.01, 0}, {812.4, 1003.1}, "", 4}));
  EXPECT_EQ(markers[1], (Marker{"lamp", {1, 2, 3}, {-0.5, 7}, "", 8}));
  EXPECT_EQ(markers_in(markers, "").size(), 2U);
}

TEST(ReadMarkers, RefusesEveryBadFileWithPlaceAndReason) {
  made::expect_refusals(
      "markers_", ".toml",
      {{"markers_empty.toml", ": has no [[marker]]"},
       {"markers_syntax.toml", ":1:"},
       {"markers_unknown_key.toml", ":5:1: unknown key \"pixels\""},
       {"markers_unknown_section.toml", ":5:"},
       {"markers_one_table.toml", ": has no [[marker]]"},
       {"markers_no_name.toml", ":1:1: this marker has no \"name\""},
       {"markers_no_pixel.toml", ":1:1: this marker has no \"pixel\""},
       {"markers_two_coordinates.toml", ":3:12: \"position\" must be a list of 3 numbers"},
       {"markers_word_for_number.toml", ":4:14: \"pixel\" must hold numbers"},
       {"markers_nan.toml", ":3:16: \"position\" must hold numbers"},
       {"markers_too_far.toml", ":3:19: \"position\" must hold numbers of at most 1e6"},
       {"markers_number_for_name.toml", ":2:8: \"name\" must be a text"},
       {"markers_name_twice.toml", ":5:1: marker \"a\" is here for the second time"},
       {"markers_two_positions.toml", ":6:1: marker \"a\" has another position"}},
      read_markers);
}

TEST(MarkersIn, ChoosesAPictureAndNamesThemAll) {
  const std::vector<Marker> markers{{"a", {}, {}, "left"}, {"a", {}, {}, "right"}};
  EXPECT_EQ(markers_in(markers, "right").size(), 1U);
  const auto reason = [&](const std::string& picture) -> std::string {
    try {
      markers_in(markers, picture);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(reason(""), HasSubstr("picture \"left\", picture \"right\""));
  EXPECT_THAT(reason("middle"), HasSubstr("no marker is of picture \"middle\""));
}

TEST(MarkersOf, PlacesABoardInTheSet) {
  Board board;
  board.columns = 7;
  board.rows = 5;
  board.square_m = 0.08;
  made::Random random(2);
  const Pose set_from_board = inverse(look_at({1, 2, 0.5}, {0, 0, 1}, 0.3));
  const Pose cam_from_set = look_at({-1.2, -1, 0.9}, {1, 2, 0.5}, 0.1);
  BoardView view{"plate", {}};
  for (std::size_t i = 0; i < board.corner_count(); ++i) {
    const auto q = project(made::fish_eye(), cam_from_set * (set_from_board * corner_of(board, i)));
    ASSERT_TRUE(q);
    view.corners.emplace_back(Vec2{q->x + 0.1 * random.normal(), q->y + 0.1 * random.normal()});
  }
  view.corners[8].reset();
  const std::vector<Marker> markers = markers_of(board, view, set_from_board);
  ASSERT_EQ(markers.size(), board.corner_count() - 1);
  EXPECT_EQ(markers[8].name, "1,2");
  EXPECT_EQ(markers[8].picture, "plate");
  const Registration found = register_camera(sights_of(made::fish_eye(), markers), {0.1});
  EXPECT_LT(made::chi_square(found, cam_from_set), 25);
  view.corners.pop_back();
  EXPECT_THROW(markers_of(board, view, set_from_board), std::invalid_argument);
}

TEST(SightsOf, NamesTheMarkerThatTheLensDoesNotSee) {
  const std::vector<Marker> markers{{"a", {}, {600, 600}, ""}, {"far out", {}, {-900, 600}, ""}};
  try {
    sights_of(made::fish_eye(), markers);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("marker \"far out\": the lens sees nothing at [-900, 600]"));
  }
}

TEST(SightsOf, NamesTheMarkerOutsideOfThePicture) {
  const Lens lens{"pinhole", 640, 480, {600, 600, 319.5, 239.5}};
  const std::vector<Marker> at_the_rim{{"a", {}, {-0.5, -0.5}, ""}, {"b", {}, {640, 480}, ""}};
  EXPECT_EQ(sights_of(lens, at_the_rim).size(), 2U);
  const std::vector<Marker> markers{{"a", {}, {600, 400}, ""}, {"off", {}, {812.5, 300}, "", 12}};
  try {
    sights_of(lens, markers);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("marker \"off\" of line 12: [812.5, 300] lies outside of "
                                        "the lens's picture, 640x480"));
  }
}

}  // namespace
}  // namespace calibrate::markers_test
