// Files of camera responses: what was written is read, and nothing else.
#include "capture/camera_response.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <stdexcept>

#include "capture/camera.h"
#include "capture/files.h"
#include "capture/png.h"
#include "tests/made_files.h"

namespace capture::camera_response_test {
namespace {

CameraResponse made_linear() {
  LinearResponse linear;
  linear.full_code = 4095;
  linear.black = {64.25, 63.5, 65};
  linear.white = {4000, 4095, 3900};
  linear.gain = {4.9, 5, 5.1};
  linear.read_noise = {0.8, 0.9, 1};
  linear.noise = {.read = 1e-7, .shot = 5e-5, .relative = 0, .saturation = 0.97};
  return {linear_response(), linear};
}

TEST(WriteResponse, KeepsALinearSensor) {
  const std::string path = made::make_temporary_directory() / "a.toml";
  const CameraResponse written = made_linear();
  write_response(path, written);
  const CameraResponse read = read_response(path);
  ASSERT_TRUE(read.linear);
  EXPECT_EQ(read.linear->full_code, 4095);
  EXPECT_EQ(read.linear->black, written.linear->black);
  EXPECT_EQ(read.linear->white, written.linear->white);
  EXPECT_EQ(read.linear->gain, written.linear->gain);
  EXPECT_EQ(read.linear->read_noise, written.linear->read_noise);
  EXPECT_DOUBLE_EQ(read.linear->noise.read, 1e-7);
  EXPECT_DOUBLE_EQ(read.linear->noise.shot, 5e-5);
  EXPECT_DOUBLE_EQ(read.linear->noise.saturation, 0.97);
  EXPECT_DOUBLE_EQ(read.light(0, 64.25 / 4095), 0);
  EXPECT_DOUBLE_EQ(read.light(2, 3900.0 / 4095), 1);
  EXPECT_LT(read.light(1, 0), 0);  // noise below black stays below it
  EXPECT_EQ(read.curve.light[0][0], 0);
  EXPECT_EQ(read.curve.light[2][255], 1);
}

TEST(WriteResponse, KeepsACurveOfNoForm) {
  const std::string path = made::make_temporary_directory() / "a.toml";
  CameraResponse written{srgb_response(), std::nullopt};
  write_response(path, written);
  const CameraResponse read = read_response(path);
  EXPECT_FALSE(read.linear);
  EXPECT_EQ(read.curve.name, "sRGB");
  for (std::size_t z = 0; z < 256; ++z) {
    EXPECT_NEAR(read.curve.light[1][z], written.curve.light[1][z], 1e-8);
    EXPECT_NEAR(read.light(1, static_cast<double>(z) / 255), written.curve.light[1][z], 1e-8);
  }
}

TEST(WriteResponse, RefusesWhatAKindOfFileCannotHold) {
  const auto directory = made::make_temporary_directory();
  EXPECT_THROW(write_response(directory / "a.rsp", made_linear()), std::invalid_argument);
  EXPECT_THROW(write_response(directory / "a.rsp", {srgb_response(), std::nullopt}),
               std::invalid_argument);
  EXPECT_THROW(write_response(directory / "a.txt", made_linear()), std::invalid_argument);
  for (const double power : {-1.0, 0.0}) {
    Response curve;
    for (auto& channel : curve.light) {
      for (std::size_t z = 0; z < channel.size(); ++z) {
        channel[z] = std::pow(static_cast<double>(z + 1) / 256, power);
      }
    }
    EXPECT_EQ(is_sound(curve), power == 0);
    curve.light[1][0] = 2;
    EXPECT_THROW(write_response(directory / "a.toml", {curve, std::nullopt}),
                 std::invalid_argument);
    EXPECT_FALSE(std::filesystem::exists(directory / "a.toml"));
  }
  EXPECT_THROW(write_response(directory / "absent" / "a.toml", made_linear()), std::runtime_error);
}

TEST(OpenCamera, ReadsALinearSensorsPicturesByItsResponse) {
  const auto directory = made::make_temporary_directory();
  CameraResponse response = made_linear();
  response.linear->full_code = 255;
  response.linear->black = {5, 10, 15};
  response.linear->white = {205, 210, 215};
  write_response(directory / "camera.toml", response);
  write_png(directory / "a.png", 1, 1, 3, std::vector<std::uint8_t>{105, 10, 215});
  CameraOptions options;
  options.response = directory / "camera.toml";
  const auto frame = open_camera((directory / "a.png").string(), options)->next();
  EXPECT_NEAR(frame->image->at(0, 0, 0), 0.5, 1e-6);
  EXPECT_NEAR(frame->image->at(0, 0, 1), 0, 1e-6);
  EXPECT_NEAR(frame->image->at(0, 0, 2), 1, 1e-6);
}

TEST(ReadResponse, RefusesEveryBadFileWithItsReason) {
  made::expect_refusals("response_", ".toml",
                        {{"response_no_toml.toml", ":1:9: "},
                         {"response_no_model.toml", "\"model\" is missing"},
                         {"response_model_of_ours_not.toml", ":1:9: \"model\" must be"},
                         {"response_unknown_key.toml", ":8:1: there is no key \"gamma\""},
                         {"response_unknown_noise.toml", "there is no key \"noise.flicker\""},
                         {"response_white_below_black.toml", "must be above \"black\""},
                         {"response_two_blacks.toml", ":3:9: \"black\" must be a list of 3"},
                         {"response_nan.toml", "\"white\" must be made of numbers"},
                         {"response_short_curve.toml", "\"red\" must be a list of 256"}},
                        [](const std::string& path) { read_response(path); });
}

TEST(ReadResponse, RefusesCurvesThatFallOrEndFarFromWhite) {
  const std::string path = made::make_temporary_directory() / "a.toml";
  const auto refusal = [&](auto change) -> std::string {
    CameraResponse response{linear_response(), std::nullopt};
    change(response.curve.light[1]);
    std::ofstream file(path);  // write_response refuses them as well
    file << std::setprecision(17) << "model = \"curve\"\nname = \"linear\"\n";
    for (std::size_t c = 0; c < 3; ++c) {
      file << std::array{"red", "green", "blue"}[c] << " = [";
      for (const double light : response.curve.light[c]) file << light << ", ";
      file << "]\n";
    }
    file.close();
    try {
      read_response(path);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_NE(refusal([](auto& light) { light[100] = 0.1; }).find("\"green\" falls at code 100"),
            std::string::npos);
  EXPECT_NE(refusal([](auto& light) { light.fill(0.5); }).find("must end near 1"),
            std::string::npos);
}

}  // namespace
}  // namespace capture::camera_response_test
