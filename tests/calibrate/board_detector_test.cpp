// Boards in made and in real pictures, against the truth and the clock.
#include "calibrate/board_detector.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <string>

#include "calibrate/angles.h"
#include "calibrate/board_drawing.h"
#include "calibrate/charuco.h"
#include "calibrate/corner_refinement.h"
#include "capture/files.h"
#include "capture/still.h"
#include "tests/calibrate/made_board_picture.h"
#include "tests/made_files.h"

namespace calibrate::board_detector_test {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using testing::HasSubstr;

const Board chessboard{Board::Kind::chessboard, 8, 5, .04, 0, ""};
const Board charuco{Board::Kind::charuco, 8, 5, .04, .03, "DICT_5X5_100"};
const Lens pinhole{"pinhole", 640, 480, {560, 560, 318, 241}};
const Lens fisheye{"kannala_brandt", 800, 800, {256, 256, 398.2, 402.7, -.01, .002}};
// Machines may be slow and busy: what is found within this is found.
const DetectionOptions patient{milliseconds(60'000)};

Pose pose_off_axis(const Board& board,
                   double least_deg,
                   double most_deg,
                   double distance_m,
                   std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const double off_axis = (least_deg + (most_deg - least_deg) * uniform(random)) * degree;
  const double azimuth = 2 * std::numbers::pi * uniform(random);
  return made::make_board_pose(board,
                               {std::sin(off_axis) * std::cos(azimuth),
                                std::sin(off_axis) * std::sin(azimuth), std::cos(off_axis)},
                               distance_m, .4, 3, random);
}

GreyPicture noise_picture(int width, int height) {
  std::mt19937 random(3);
  GreyPicture picture{width, height, {}};
  for (int i = 0; i < width * height; ++i) {
    picture.pixels.push_back(static_cast<std::uint8_t>(random() % 256));
  }
  return picture;
}

// A folder with a platelight-detect that is this script instead, for as long as it lives.
class OtherHelper {
 public:
  explicit OtherHelper(const std::string& script) {
    const fs::path folder = made::make_temporary_directory();
    const fs::path path = folder / "platelight-detect";
    std::ofstream(path) << "#!/bin/sh\n" << script << "\n";
    fs::permissions(path, fs::perms::owner_all);
    setenv("PLATELIGHT_HELPERS", folder.c_str(), 1);
  }
  ~OtherHelper() { unsetenv("PLATELIGHT_HELPERS"); }
  OtherHelper(const OtherHelper&) = delete;
  OtherHelper& operator=(const OtherHelper&) = delete;
};

TEST(DetectBoard, FindsBoardsThroughAPinhole) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    std::mt19937 random(seed);
    const Board& board = seed % 2 == 0 ? chessboard : charuco;
    const Pose pose = pose_off_axis(board, 0, 6, .6, random);
    made::BoardPictureOptions options;
    options.seed = seed;
    const BoardDetection found =
        detect_board(made::render_board(board, pose, pinhole, options), board, patient);
    ASSERT_TRUE(found.view) << seed << ": " << found.reason;
    EXPECT_TRUE(found.reason.empty());
    const auto errors = made::corner_errors(*found.view, made::true_corners(board, pose, pinhole));
    EXPECT_GE(errors.count, .9 * 40) << seed;
    EXPECT_LT(errors.rms_px, .15) << seed;
    EXPECT_LT(errors.max_px, .6) << seed;
  }
}

TEST(DetectBoard, TriesTheFastFinderAloneIfItMustBeQuick) {
  DetectionOptions quick = patient;
  quick.quick = true;
  std::mt19937 random(2);
  const Pose pose = pose_off_axis(chessboard, 0, 6, .6, random);
  EXPECT_EQ(detect_board(made::render_board(chessboard, pose, pinhole), chessboard, quick).finder,
            "findChessboardCorners");
  const BoardDetection none = detect_board(noise_picture(320, 240), chessboard, quick);
  EXPECT_FALSE(none.view);
  EXPECT_THAT(none.reason, HasSubstr("findChessboardCorners found"));
  EXPECT_THAT(none.reason, testing::Not(HasSubstr("findChessboardCornersSB")));
}

TEST(DetectBoard, FindsBoardsThroughAFisheyeUpTo55Degrees) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    std::mt19937 random(seed);
    const Board& board = seed % 2 == 0 ? chessboard : charuco;
    const Pose pose = pose_off_axis(board, 10. * (seed / 2), 55, .32, random);
    const GreyPicture picture = made::render_board(board, pose, fisheye);
    const BoardDetection found = detect_board(picture, board, patient);
    ASSERT_TRUE(found.view) << seed << ": " << found.reason;
    const auto errors = made::corner_errors(refine_corners(picture, *found.view, board, fisheye),
                                            made::true_corners(board, pose, fisheye));
    EXPECT_GE(errors.count, .9 * 40) << seed;
    EXPECT_LT(errors.rms_px, .15) << seed;
    EXPECT_LT(errors.max_px, .6) << seed;
  }
}

TEST(DetectBoard, FindsCharucoBoardsAtTheRim) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    std::mt19937 random(seed);
    const Pose pose = pose_off_axis(charuco, 55, 75, .32, random);
    const GreyPicture picture = made::render_board(charuco, pose, fisheye);
    const BoardDetection found = detect_board(picture, charuco, patient);
    ASSERT_TRUE(found.view) << seed << ": " << found.reason;
    const auto truth = made::true_corners(charuco, pose, fisheye);
    const auto errors =
        made::corner_errors(refine_corners(picture, *found.view, charuco, fisheye), truth);
    EXPECT_GE(errors.count, .8 * static_cast<double>(count_corners({"", truth}))) << seed;
    EXPECT_LT(errors.rms_px, .15) << seed;
  }
}

TEST(DetectBoard, TellsTheCornersOfAPartOfACharucoBoard) {
  std::mt19937 random(1);
  const Pose pose = made::make_board_pose(charuco, {.45, .3, 1}, .5, .2, .3, random);
  const auto truth = made::true_corners(charuco, pose, pinhole);
  ASSERT_LT(count_corners({"", truth}), 30u);
  ASSERT_GT(count_corners({"", truth}), 9u);
  const BoardDetection found =
      detect_board(made::render_board(charuco, pose, pinhole), charuco, patient);
  ASSERT_TRUE(found.view) << found.reason;
  const auto errors = made::corner_errors(*found.view, truth);
  EXPECT_GE(errors.count, 6u);
  EXPECT_LT(errors.max_px, 1);  // infinite for what is not in the picture
}

TEST(DetectBoard, ReadsTheLayoutOfOlderOpenCvToo) {
  // A board with a white first square is one more row below a black one, without its first row:
  // markers then begin in another square. Numbers tell them apart.
  std::vector<SeenMarker> markers;
  const std::vector<Square> squares = marker_squares(charuco, FirstSquare::white);
  for (std::size_t i = 0; i < squares.size(); ++i) {
    const double left = squares[i].column * 40 + 5, top = squares[i].row * 40 + 5;
    markers.push_back(
        {static_cast<int>(i),
         {Vec2{left, top}, Vec2{left + 30, top}, Vec2{left + 30, top + 30}, Vec2{left, top + 30}}});
  }
  const BoardView view = corners_of_markers(charuco, markers);
  EXPECT_EQ(count_corners(view), 40u);
  EXPECT_NEAR(view.corners[9]->x, 80, 1e-9);
  EXPECT_NEAR(view.corners[9]->y, 80, 1e-9);
}

TEST(DetectBoard, LooksIntoStraightenedViewsOfAFisheye) {
  const Lens large{"kannala_brandt", 1024, 1024, {330, 330, 510, 514, -.01, .002}};
  const Board board{Board::Kind::chessboard, 10, 7, .04, 0, ""};
  std::mt19937 random(206);  // one of the few boards at the rim that need it
  std::uniform_real_distribution<double> uniform(0, 1);
  const double off_axis = (55 + 20 * uniform(random)) * degree;
  const double azimuth = 2 * std::numbers::pi * uniform(random);
  const double distance_m = .32 + .25 * uniform(random);
  const Pose pose =
      made::make_board_pose(board,
                            {std::sin(off_axis) * std::cos(azimuth),
                             std::sin(off_axis) * std::sin(azimuth), std::cos(off_axis)},
                            distance_m, .45, 1, random);
  const GreyPicture picture = made::render_board(board, pose, large);
  DetectionOptions options{milliseconds(20'000)};  // of which the first finder takes its share here
  options.fisheye = true;
  const BoardDetection found = detect_board(picture, board, options);
  ASSERT_TRUE(found.view) << found.reason;
  EXPECT_THAT(found.finder, HasSubstr("straightened"));
  const auto errors = made::corner_errors(refine_corners(picture, *found.view, board, large),
                                          made::true_corners(board, pose, large));
  EXPECT_LT(errors.rms_px, .15);
}

TEST(DetectBoard, NeverMirrorsABoard) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    std::mt19937 random(seed);
    const Board board{Board::Kind::chessboard, 5 + static_cast<int>(seed % 3), 5, .04, 0, ""};
    const Pose pose = made::make_board_pose(board, {0, 0, 1}, .5, .3, 3.1, random);
    const BoardDetection found =
        detect_board(made::render_board(board, pose, pinhole), board, patient);
    ASSERT_TRUE(found.view) << seed << ": " << found.reason;
    const auto& q = found.view->corners;
    const auto below = static_cast<std::size_t>(board.columns);
    ASSERT_TRUE(q[0] && q[1] && q[below]);
    EXPECT_GT((q[1]->x - q[0]->x) * (q[below]->y - q[0]->y) -
                  (q[1]->y - q[0]->y) * (q[below]->x - q[0]->x),
              0)
        << seed;
    // Where colours tell which way round a board is, it is that way round.
    if (board.columns == 6) {
      EXPECT_LT(made::corner_errors(*found.view, made::true_corners(board, pose, pinhole)).max_px,
                1)
          << seed;
    }
  }
}

TEST(DetectBoard, RefusesAMirroredCharucoBoard) {
  std::mt19937 random(1);
  const Pose pose = made::make_board_pose(charuco, {0, 0, 1}, .5, .2, .3, random);
  GreyPicture picture = made::render_board(charuco, pose, pinhole);
  for (int y = 0; y < picture.height; ++y) {
    std::reverse(picture.pixels.begin() + y * picture.width,
                 picture.pixels.begin() + (y + 1) * picture.width);
  }
  EXPECT_FALSE(detect_board(picture, charuco, patient).view);
}

TEST(DetectBoard, RefusesAPartOfALargerBoard) {
  Board larger = chessboard;
  larger.columns += 2;
  for (unsigned seed = 0; seed < 2; ++seed) {
    std::mt19937 random(seed);
    const Pose pose = made::make_board_pose(larger, {0, 0, 1}, .6, .3, .5, random);
    const BoardDetection found =
        detect_board(made::render_board(larger, pose, pinhole), chessboard, patient);
    EXPECT_FALSE(found.view) << seed;
    EXPECT_THAT(found.reason, HasSubstr("no board in ")) << seed;
  }
}

TEST(DetectBoard, IsRightOrSilentUnderMotionBlur) {
  for (const Board& board : {chessboard, charuco}) {
    std::mt19937 random(4);
    const Pose pose = made::make_board_pose(board, {0, 0, 1}, .55, .3, .3, random);
    const auto truth = made::true_corners(board, pose, pinhole);
    std::size_t last_found = 0;
    for (const double motion_px : {2., 6., 12., 24., 48.}) {
      made::BoardPictureOptions options;
      options.view.motion_px = motion_px;
      const BoardDetection found =
          detect_board(made::render_board(board, pose, pinhole, options), board, patient);
      last_found = found.view ? count_corners(*found.view) : 0;
      if (found.view) {
        EXPECT_LT(made::corner_errors(*found.view, truth).max_px, 1) << motion_px;
      } else {
        EXPECT_FALSE(found.reason.empty()) << motion_px;
      }
      if (motion_px <= 2) {
        EXPECT_GT(last_found, 30u) << found.reason;
      }
    }
    EXPECT_EQ(last_found, 0u) << "a board smeared over more than a square";
  }
}

TEST(DetectBoard, IsRightOrSilentOnDamagedPictures) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    std::mt19937 random(seed);
    const Board& board = seed % 2 == 0 ? chessboard : charuco;
    const Pose pose = made::make_board_pose(board, {0, 0, 1}, .55, .3, .3, random);
    GreyPicture picture = made::render_board(board, pose, pinhole);
    // Stripes of another place, as when rows of a stream are lost.
    const int top = 150 + 40 * static_cast<int>(seed / 2);
    for (int y = top; y < top + 24; ++y) {
      for (int x = 0; x < picture.width; ++x)
        picture.at(y, x) = picture.at(y - 60, (x + 211) % 640);
    }
    const BoardDetection found = detect_board(picture, board, patient);
    if (!found.view) continue;
    const auto errors = made::corner_errors(*found.view, made::true_corners(board, pose, pinhole));
    EXPECT_LT(errors.max_px, 1) << seed;
  }
}

TEST(DetectBoard, FindsNothingInNoise) {
  for (const Board& board : {chessboard, charuco}) {
    DetectionOptions options;
    options.fisheye = true;
    const BoardDetection found = detect_board(noise_picture(640, 480), board, options);
    EXPECT_FALSE(found.view);
    EXPECT_THAT(found.reason, HasSubstr("no board"));
    EXPECT_LT(found.time_ms, options.time_limit.count() + 2000);
  }
}

TEST(DetectBoard, EndsFindersThatNeverEnd) {
  const OtherHelper endless("exec sleep 60");
  DetectionOptions options{milliseconds(600)};
  const BoardDetection found = detect_board(noise_picture(64, 48), chessboard, options);
  EXPECT_FALSE(found.view);
  EXPECT_THAT(found.reason, HasSubstr("no board within the time limit of 0.6 s: "));
  EXPECT_THAT(found.reason, HasSubstr("findChessboardCorners was ended after"));
  EXPECT_LT(found.time_ms, 600 + 2000);
}

TEST(DetectBoard, KeepsItsLimitInAPictureThatTakesLong) {
  // Thousands of squares keep OpenCV's finders busy for minutes.
  const Board crowd{Board::Kind::chessboard, 160, 120, .01, 0, ""};
  const GreyPicture picture = draw_board(crowd, 12, 20);
  const BoardDetection found = detect_board(picture, chessboard, {milliseconds(400)});
  EXPECT_FALSE(found.view);
  EXPECT_THAT(found.reason, HasSubstr("ended after"));
  EXPECT_LT(found.time_ms, 400 + 2000);
}

TEST(DetectBoard, OutlivesFindersThatCrash) {
  const OtherHelper crashing("kill -SEGV $$");
  const BoardDetection found = detect_board(noise_picture(64, 48), charuco, patient);
  EXPECT_FALSE(found.view);
  EXPECT_THAT(found.reason,
              HasSubstr("detectMarkers failed: the helper program crashed (SIGSEGV)"));
}

TEST(DetectBoard, TrustsNoNumbersOfAFinder) {
  for (const char* script :
       {"printf '\\377\\377\\377\\377'", "printf '\\001\\000\\000\\000'", "head -c 700 /dev/zero",
        "printf '\\050\\000\\000\\000'; tr '\\000' '\\377' < /dev/zero | head -c 640"}) {
    const OtherHelper lying(script);
    const BoardDetection found = detect_board(noise_picture(64, 48), chessboard, patient);
    EXPECT_FALSE(found.view) << script;
    EXPECT_THAT(found.reason, HasSubstr("no board")) << script;
  }
}

TEST(DetectBoard, RefusesWhatCannotBe) {
  const GreyPicture picture = noise_picture(64, 48);
  EXPECT_THROW(detect_board({}, chessboard), std::invalid_argument);
  EXPECT_THROW(detect_board(picture, {}), std::invalid_argument);
  EXPECT_THROW(detect_board(picture, chessboard, {milliseconds(0)}), std::invalid_argument);
  EXPECT_THROW(detect_board(picture, chessboard, {milliseconds(100), pinhole}),
               std::invalid_argument);
  Board board = charuco;
  board.dictionary = "DICT_9X9";
  EXPECT_THROW(detect_board(picture, board), std::invalid_argument);
}

GreyPicture read_grey(const fs::path& path) {
  const capture::Still8 still =
      capture::decode_still8(capture::read_file(path.string()), path.string());
  GreyPicture grey{still.width, still.height, {}};
  const auto channels = static_cast<std::size_t>(still.channels);
  for (std::size_t i = 0; i < still.texels.size(); i += channels) {
    grey.pixels.push_back(still.texels[i + 1]);
  }
  return grey;
}

void expect_all_found(const fs::path& folder,
                      const std::string& begin,
                      const Board& board,
                      std::size_t pictures) {
  if (!fs::exists(folder)) GTEST_SKIP() << "the data folder is missing: " << folder;
  std::size_t seen = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    const std::string ending = entry.path().extension().string();
    if (!name.starts_with(begin) || (ending != ".jpg" && ending != ".JPG")) continue;
    ++seen;
    const BoardDetection found = detect_board(read_grey(entry.path()), board, patient);
    ASSERT_TRUE(found.view) << name << ": " << found.reason;
    EXPECT_EQ(count_corners(*found.view), board.corner_count()) << name << ": " << found.finder;
  }
  EXPECT_EQ(seen, pictures);
}

TEST(DetectBoard, FindsTheBoardInEveryPictureOfOpenCvsSet) {
  const Board board{Board::Kind::chessboard, 9, 6, .025, 0, ""};
  expect_all_found(made::real_data() / "calib/opencv_normal", "left", board, 13);
}

// Its outer squares are cut in half, so that a column less or more nearly fits.
TEST(DetectBoard, RefusesBoardsOfOtherSizesInOpenCvsSet) {
  const fs::path folder = made::real_data() / "calib/opencv_normal";
  if (!fs::exists(folder)) GTEST_SKIP() << "the data folder is missing: " << folder;
  for (const char* name : {"left02.jpg", "left07.jpg"}) {
    const GreyPicture picture = read_grey(folder / name);
    for (const int columns : {8, 10}) {
      const Board board{Board::Kind::chessboard, columns, 6, .025, 0, ""};
      EXPECT_FALSE(detect_board(picture, board, patient).view) << name << ", " << columns;
    }
  }
}

TEST(DetectBoard, FindsTheBoardInEveryPictureOfAGoPro) {
  const Board board{Board::Kind::chessboard, 15, 9, .026, 0, ""};
  expect_all_found(made::real_data() / "calib/gopro_fisheye", "3D_", board, 16);
}

}  // namespace
}  // namespace calibrate::board_detector_test
