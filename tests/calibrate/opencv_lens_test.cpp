// Lenses in OpenCV's files.
#include "calibrate/opencv_lens.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <numbers>
#include <random>
#include <sstream>
#include <vector>

#include <opencv2/core.hpp>

#include "tests/made_files.h"

namespace calibrate::opencv_lens_test {
namespace {

using testing::HasSubstr;

std::vector<Lens> representable() {
  return {
      {"pinhole", 640, 480, {500.5, 501.25, 319.5, 1.0 / 3}},
      {"LENSMODEL_OPENCV4", 768, 576, {1184.97, 1194.57, 324.222, 282.566, -.15662, .06178, 0, 0}},
      {"LENSMODEL_OPENCV5", 640, 480, {500, 501, 320, 240, -.1, .01, 1e-4, -2e-5, 1e-9}},
      {"LENSMODEL_OPENCV8", 640, 480, {500, 501, 320, 240, -.1, .01, 1e-4, -2e-5, .1, .2, .3, .4}},
      {"LENSMODEL_OPENCV12",
       640,
       480,
       {500, 501, 320, 240, -.1, .01, 1e-4, -2e-5, .1, .2, .3, .4, 1e-3, 2e-3, -1e-3, 1e-5}},
      {"kannala_brandt",
       1024,
       1024,
       {331, 332, 513.3, 509.1, -.02, .003, -1e-4, 1e-5},
       1.5,
       0.1 / 3},
      {"kannala_brandt", 1024, 1024, {331, 332, 513.3, 509.1, -.02, .003, 0, 0}},
  };
}

TEST(WriteOpencvLens, IsUndoneByReadLens) {
  const auto directory = made::make_temporary_directory();
  for (const Lens& lens : representable()) {
    for (const char* name : {"lens.yml", "lens.yaml", "lens.xml"}) {
      const std::string path = directory / name;
      write_lens(path, lens);
      Lens read = read_lens(path);
      EXPECT_NEAR(read.max_angle_rad, lens.max_angle_rad, 1e-14);
      read.max_angle_rad = lens.max_angle_rad;
      EXPECT_EQ(read, lens) << path;
    }
  }
}

TEST(WriteOpencvLens, IsReadByOpencvWithTheSameNumbers) {
  const auto directory = made::make_temporary_directory();
  for (const Lens& lens : representable()) {
    for (const char* name : {"lens.yml", "lens.xml"}) {
      const std::string path = directory / name;
      write_lens(path, lens);
      const cv::FileStorage file(path, cv::FileStorage::READ);
      EXPECT_EQ(static_cast<int>(file["image_width"]), lens.width);
      EXPECT_EQ(static_cast<int>(file["image_height"]), lens.height);
      cv::Mat camera, coefficients;
      file["camera_matrix"] >> camera;
      file["distortion_coefficients"] >> coefficients;
      ASSERT_EQ(camera.rows, 3);
      ASSERT_EQ(camera.type(), CV_64F);
      EXPECT_EQ(camera.at<double>(0, 0), lens.parameters[0]);
      EXPECT_EQ(camera.at<double>(1, 1), lens.parameters[1]);
      EXPECT_EQ(camera.at<double>(0, 2), lens.parameters[2]);
      EXPECT_EQ(camera.at<double>(1, 2), lens.parameters[3]);
      EXPECT_EQ(camera.at<double>(2, 2), 1);
      ASSERT_EQ(coefficients.total(), lens.parameters.size() - 4);
      for (std::size_t i = 4; i < lens.parameters.size(); ++i) {
        EXPECT_EQ(coefficients.at<double>(static_cast<int>(i) - 4, 0), lens.parameters[i]);
      }
      EXPECT_EQ(static_cast<int>(file["fisheye_model"]), lens.model == "kannala_brandt" ? 1 : 0);
    }
  }
}

TEST(WriteOpencvLens, RefusesWhatOpencvHasNoModelFor) {
  const std::string path = made::make_temporary_directory() / "lens.yml";
  EXPECT_THROW(write_lens(path, {"equisolid", 2808, 1872, {622.4, 1412.5, 932}}),
               std::invalid_argument);
  EXPECT_THROW(write_lens(path, {"LENSMODEL_STEREOGRAPHIC", 640, 480, {300, 300, 320, 240}}),
               std::invalid_argument);
}

// As OpenCV's own programs write it, with all that lies around.
std::string written_by_opencv(const std::string& path, int coefficients, bool fisheye) {
  cv::FileStorage file(path, cv::FileStorage::WRITE);
  const cv::Mat camera = (cv::Mat_<double>(3, 3) << 530.1, 0, 342.2, 0, 529.7, 235.5, 0, 0, 1);
  cv::Mat distortion(coefficients, 1, CV_64F);
  for (int i = 0; i < coefficients; ++i) distortion.at<double>(i) = 0.01 * (i + 1) - 0.02;
  file << "calibration_time"
       << "Mon: 27 [Jul] 2026 # not a comment";
  file << "image_width" << 640 << "image_height" << 480;
  if (fisheye) file << "fisheye_model" << 1;
  file.writeComment("flags: +fix_k1");
  file << "camera_matrix" << camera << "distortion_coefficients" << distortion;
  file << "views"
       << "[" << camera << "{"
       << "name"
       << "a.png"
       << "error" << 0.25 << "}"
       << "]";
  file << "per_view_reprojection_errors" << cv::Mat(cv::Mat::zeros(13, 1, CV_32F));
  return path;
}

TEST(ReadOpencvLens, ReadsWhatOpencvWrites) {
  const auto directory = made::make_temporary_directory();
  for (const char* name : {"lens.yml", "lens.xml"}) {
    for (const int count : {4, 5, 8, 12}) {
      const Lens lens = read_lens(written_by_opencv(directory / name, count, false));
      EXPECT_EQ(lens.model, "LENSMODEL_OPENCV" + std::to_string(count));
      EXPECT_EQ(lens.width, 640);
      EXPECT_EQ(lens.parameters[1], 529.7);
      EXPECT_EQ(lens.parameters[2], 342.2);
      EXPECT_EQ(lens.parameters.back(), 0.01 * count - 0.02);
    }
    const Lens fisheye = read_lens(written_by_opencv(directory / name, 4, true));
    EXPECT_EQ(fisheye.model, "kannala_brandt");
    EXPECT_EQ(fisheye.parameters.back(), 0.01 * 4 - 0.02);
  }
}

TEST(ReadOpencvLens, RefusesParametersThatItWouldDrop) {
  const auto directory = made::make_temporary_directory();
  const std::string path = directory / "lens.yml";
  const auto reason_of = [&](const std::string& parameters) -> std::string {
    std::ofstream(path) << "image:\n  width: 640\n  height: 480\nparameter:\n  fx: 530\n"
                           "  fy: 530\n  cx: 320\n  cy: 240\n" +
                               parameters;
    try {
      return read_lens(path).model;
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  };
  EXPECT_EQ(reason_of(""), "pinhole");
  EXPECT_EQ(reason_of("  k2: 0\n"), "pinhole");
  EXPECT_EQ(reason_of("  k1: 0.1\n  p1: 0.01\n  k3: 0.2\n"), "LENSMODEL_OPENCV5");
  EXPECT_EQ(reason_of("  k1: 0.1\n  k4: 0.2\n"), "kannala_brandt");
  EXPECT_THAT(reason_of("  k2: 0.1\n"), HasSubstr("lens.yml:9: parameter \"k2\""));
  EXPECT_THAT(reason_of("  p1: 0.1\n  p2: 0.1\n"), HasSubstr("without k1"));
  EXPECT_THAT(reason_of("  k1: 0.1\n  p1: 0\n  k4: 0.2\n"), HasSubstr("\"k4\""));
  EXPECT_THAT(reason_of("  k1: 0.1\n  skew: 2\n"), HasSubstr("\"skew\""));
}

TEST(ReadOpencvLens, ReadsTheFilesOfRosAndKalibr) {
  const auto directory = made::make_temporary_directory();
  const std::string ros = directory / "ros.yaml";
  std::ofstream(ros) << "image_width: 640\nimage_height: 480\ncamera_name: left  # front\n"
                        "camera_matrix:\n  rows: 3\n  cols: 3\n"
                        "  data: [500.5, 0, 320, 0, 501, 240, 0, 0, 1]\n"
                        "distortion_model: equidistant\n"
                        "distortion_coefficients:\n  rows: 1\n  cols: 4\n"
                        "  data: [0.1, 0.02,\n    -0.3, 0.04]\n";
  EXPECT_EQ(read_lens(ros),
            (Lens{"kannala_brandt", 640, 480, {500.5, 501, 320, 240, .1, .02, -.3, .04}}));
  const std::string kalibr = directory / "camchain.yaml";
  std::ofstream(kalibr)
      << "cam0:\n  cam_overlaps: []\n  camera_model: pinhole\n"
         "  distortion_coeffs: [0.1, 0.02, 0.003, 0.0004]\n"
         "  distortion_model: radtan\n  intrinsics: [461.6, 460.3, 366.3, 249.1]\n"
         "  T_cam_imu:\n  - [1, 0, 0, 0]\n  - [0, 1, 0, 0]\n"
         "  resolution: [752, 480]\n  rostopic: /cam0/image_raw\n";
  EXPECT_EQ(
      read_lens(kalibr),
      (Lens{"LENSMODEL_OPENCV4", 752, 480, {461.6, 460.3, 366.3, 249.1, .1, .02, .003, .0004}}));
}

TEST(ReadOpencvLens, ReadsRealFilesAndRefusesOthersByTheirModel) {
  const auto data = made::real_data() / "calib";
  if (!std::filesystem::exists(data / "samples")) GTEST_SKIP() << "no " << data;
  EXPECT_EQ(read_lens(data / "samples/pinhole.yml").model, "pinhole");
  EXPECT_EQ(read_lens(data / "samples/kalibr_KB.yml"),
            (Lens{"kannala_brandt",
                  752,
                  480,
                  {461.58688085556616, 460.2811732644195, 366.28603126815506, 249.08026891791644,
                   -0.012523386218579752, 0.057836801948828065, -0.08495347810986263,
                   0.04362766880887814}}));
  EXPECT_EQ(read_lens(data / "samples/kalibr_RadTan.yml").model, "LENSMODEL_OPENCV5");
  const Lens left = read_lens(data / "opencv_normal/left_intrinsics.yml");
  EXPECT_EQ(left.model, "LENSMODEL_OPENCV5");
  EXPECT_EQ(left.parameters[8], 2.3839153080878486e-01);
  EXPECT_EQ(read_lens(data / "gopro_fisheye/out_camera_fisheye_data.xml").model, "kannala_brandt");
  const auto reason = [&](const char* name) -> std::string {
    try {
      read_lens(data / name);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(reason("samples/UCM.yml"), HasSubstr("unified camera model"));
  EXPECT_THAT(reason("samples/kalibr_EUCM.yml"), HasSubstr("extended unified camera model"));
  EXPECT_THAT(reason("samples/kalibr_DS.yml"), HasSubstr("double sphere"));
  EXPECT_THAT(reason("samples/OcamCalib_OcamCalib.yml"), HasSubstr("OcamCalib"));
  EXPECT_THAT(reason("gopro_fisheye/config-fisheye.xml"), HasSubstr("no \"camera_matrix\""));
}

void expect_all_refused(const std::string& ending,
                        const std::map<std::string, std::string>& words) {
  made::expect_refusals("opencv_", ending, words, read_lens);
}

TEST(ReadOpencvLens, RefusesEveryBadFileWithPlaceAndReason) {
  expect_all_refused(
      ".yml",
      {{"opencv_empty.yml", ": has no \"camera_matrix\""},
       {"opencv_no_camera_matrix.yml", ": has no \"camera_matrix\", only image_width"},
       {"opencv_no_size.yml", ": the key \"image_width\" or \"image_height\" is missing"},
       {"opencv_size_of_zero.yml", ":3: \"image_width\" must be a whole number"},
       {"opencv_size_with_fraction.yml", ":3: \"image_width\" must be a whole number"},
       {"opencv_matrix_of_eight.yml", ":9: \"camera_matrix\" holds 8 numbers"},
       {"opencv_matrix_of_words.yml", ":9: \"camera_matrix/data\" must hold finite numbers"},
       {"opencv_nan.yml", ":9: \"camera_matrix/data\" must hold finite numbers, not \".Nan\""},
       {"opencv_skew.yml", ":9: \"camera_matrix\" has skew"},
       {"opencv_error_too_large.yml", ":10: \"error_px\" must be at most the picture's diagonal"},
       {"opencv_focal_negative.yml", ":9: a focal length must be above 0"},
       {"opencv_camera_matrix_twice.yml", ":14: \"camera_matrix/data\" is here for the second"},
       {"opencv_list_without_end.yml", ":9: a list begins here and does not end"},
       {"opencv_three_coefficients.yml", ":14: there are 3 distortion coefficients"},
       {"opencv_tilted_sensor.yml", ":14: distortion coefficients of a tilted sensor"},
       {"opencv_fisheye_of_five.yml", ":15: a fish-eye has 4 distortion coefficients, not 5"},
       {"opencv_unknown_distortion_model.yml", ":5: distortion model \"moebius\""},
       {"opencv_double_sphere.yml", ":10: the double sphere model"},
       {"opencv_no_key.yml", ":5: expects a key, a colon and a value"},
       {"opencv_tabs.yml", ":6: YAML is indented by spaces"}});
  expect_all_refused(".yaml", {{"opencv_omni_camera_model.yaml", ":2: camera model \"omni\""},
                               {"opencv_two_cameras.yaml", ": has cam0 and \"cam1\""}});
  expect_all_refused(".xml",
                     {{"opencv_other_root.xml", ":2: is not one <opencv_storage>"},
                      {"opencv_tag_without_end.xml", ":4: <opencv_storage> does not end"},
                      {"opencv_tags_crossed.xml", ":3: </a> closes what is not open"},
                      {"opencv_matrix_of_bytes.xml", ":6: \"camera_matrix\" must be of type"},
                      {"opencv_two_roots.xml", ":2: is not one <opencv_storage>"}});
}

// Files that are damaged anyhow are read, if the damage is elsewhere, or refused with their path.
TEST(ReadOpencvLens, SurvivesDamagedFiles) {
  const auto directory = made::make_temporary_directory();
  std::mt19937 random(5);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  std::size_t accepted = 0, refused = 0;
  for (const char* name : {"lens.yml", "lens.xml"}) {
    const std::string path = directory / name;
    std::ostringstream whole;
    whole << std::ifstream(written_by_opencv(path, 5, false)).rdbuf();
    const std::string words = "[]{}<>/:#!\"'-., \n\t0e9+";
    for (int i = 0; i < 250; ++i) {
      std::string text = whole.str();
      for (std::size_t k = 1 + below(4); k > 0 && !text.empty(); --k) {
        const std::size_t at = below(text.size());
        switch (below(6)) {
          case 0:
            text[at] = static_cast<char>(below(256));
            break;
          case 1:
            text[at] = words[below(words.size())];
            break;
          case 2:
            text.erase(at, below(40));
            break;
          case 3:
            text.insert(at, text.substr(below(text.size()), below(60)));
            break;
          case 4:
            text.insert(at, std::string(below(300), words[below(words.size())]));
            break;
          default:
            text.resize(at + 1);
            break;
        }
      }
      std::ofstream(path, std::ios::binary) << text;
      try {
        const Lens lens = read_lens(path);
        EXPECT_NO_THROW(check(lens));
        ++accepted;
      } catch (const std::runtime_error& error) {
        EXPECT_TRUE(std::string(error.what()).starts_with(path)) << error.what();
        ++refused;
      }
    }
  }
  EXPECT_GT(accepted, 50U);
  EXPECT_GT(refused, 50U);
}

}  // namespace
}  // namespace calibrate::opencv_lens_test
