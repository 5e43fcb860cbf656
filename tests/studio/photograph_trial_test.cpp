// The composite against its photograph: what is made true brings it nearer, and the parts add up.
#include "studio/photograph_trial.h"

#include <filesystem>
#include <fstream>
#include <numeric>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "studio/start.h"

namespace studio::photograph_trial_test {
namespace {

namespace fs = std::filesystem;

TEST(PartsOfSquare, AddUpToTheWholeWithWhatIsLeft) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> square(0.01, 1);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<double> squares(2 + trial % 6);
    for (double& s : squares) s = square(random);
    const std::vector<double> parts = parts_of_square(squares);
    ASSERT_EQ(parts.size(), squares.size() - 1);
    const double sum = std::accumulate(parts.begin(), parts.end(), 0.0);
    EXPECT_NEAR(sum + squares.back() / squares.front(), 1, 1e-12);
  }
}

TEST(PartsOfSquare, OfIndependentErrorsAreTheirOwnSquares) {
  // Errors of 3, 4 and 12, which add in squares to 13: taken away one after the other.
  EXPECT_THAT(parts_of_square({169, 160, 144, 0}),
              testing::ElementsAre(9 / 169.0, 16 / 169.0, 144 / 169.0));
}

TEST(PartsOfSquare, AreBelowZeroWhereATruthUncoversAnError) {
  EXPECT_LT(parts_of_square({1.0, 1.2}).front(), 0);
}

TEST(PartsOfSquare, RefusesNoErrorAtAll) {
  EXPECT_THROW(parts_of_square({}), std::invalid_argument);
  EXPECT_THROW(parts_of_square({0.0, 1.0}), std::invalid_argument);
}

// A tiny court and its trial.
class PhotographTrialTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    start();
    DemoSettings settings;
    settings.dir = dir();
    settings.studio = {.width = 96,
                       .height = 72,
                       .probe_size = 96,
                       .sky_height = 128,
                       .texture_size = 128,
                       .frames = 1};
    settings.samples = 4;
    const auto ignore = [](double, std::string_view) {};
    set_ = write_demo(settings, ignore).set.string();
    const DemoSettings read = read_demo_truth(dir() / "truth/truth.json");
    EXPECT_EQ(read.studio.width, 96);
    EXPECT_EQ(read.studio.texture_size, 128);
    EXPECT_EQ(read.world, DemoWorld::court);
    trial_ = new PhotographTrial(set_, {.photograph_samples = 8, .reference_samples = 32}, ignore);
  }
  static void TearDownTestSuite() {
    delete trial_;
    fs::remove_all(dir());
  }
  static fs::path dir() {
    return fs::path(testing::TempDir()) /
           ("platelight_photograph_trial" + std::to_string(getpid()));
  }

  static std::string set_;
  static PhotographTrial* trial_;
};
std::string PhotographTrialTest::set_;
PhotographTrial* PhotographTrialTest::trial_ = nullptr;

TEST_F(PhotographTrialTest, GetsBetterWithTheTruthAndWorseWithAWrongPose) {
  const render::PairedError as_it_runs = trial_->measure({}).error;
  const render::PairedError all_true = trial_->measure({true, true, true, true, true, true}).error;
  const render::PairedError wrong_pose = trial_->measure({}, 3).error;
  EXPECT_GT(as_it_runs.square, 0);
  EXPECT_LT(all_true.square + 2 * all_true.square_standard_error, as_it_runs.square);
  EXPECT_GT(wrong_pose.square, 1.5 * as_it_runs.square);
  EXPECT_GT(trial_->affected_share(), 0.3);
  EXPECT_LT(trial_->affected_share(), 0.9);
  // Only the reference follows bounces.
  EXPECT_THROW(trial_->measure({.bounces = true}), std::invalid_argument);
}

TEST_F(PhotographTrialTest, HasTheRealShadowWhereItsMatteIsTrue) {
  // Beside the car, where its shadow lies, nothing but noise is left.
  const capture::Image composite = trial_->composite({.plate = true, .matte = true});
  double sum = 0, whole = 0;
  for (int y = 0; y < composite.height; ++y) {
    for (int x = composite.width * 4 / 5; x < composite.width; ++x) {
      sum += composite.at(y, x, 1);
      whole += trial_->photograph().at(y, x, 1);
    }
  }
  EXPECT_NEAR(sum / whole, 1, 0.02);
}

TEST(ReadDemoTruth, RefusesWhatNoDemoWrote) {
  const fs::path file =
      fs::path(testing::TempDir()) / ("platelight_no_truth" + std::to_string(getpid()) + ".json");
  for (const char* text : {"", "{}", "[1", R"({"world": "moon"})"}) {
    std::ofstream(file) << text;
    try {
      read_demo_truth(file);
      ADD_FAILURE() << "took " << text;
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(file.filename().string()));
    }
  }
  fs::remove(file);
}

}  // namespace
}  // namespace studio::photograph_trial_test
