// The curves between codes and light.
#include "capture/colour.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <stdexcept>

namespace capture::colour_test {
namespace {

constexpr std::array transfers{Transfer::rec1886, Transfer::srgb, Transfer::rec709_camera,
                               Transfer::linear};

TEST(Encode, UndoesDecodeWithinAndBeyondTheRange) {
  for (const Transfer transfer : transfers) {
    for (int i = -6000; i <= 6000; ++i) {
      const double value = i / 4000.0;
      EXPECT_NEAR(encode(transfer, decode(transfer, value)), value, 1e-14) << name_of(transfer);
    }
  }
}

TEST(Decode, UndoesEncodeButForTheStepOfSrgb) {
  for (const Transfer transfer : transfers) {
    // The published constants of sRGB leave a step of 2e-9 in light between its two pieces.
    const double tolerance = transfer == Transfer::srgb ? 5e-9 : 1e-14;
    for (int i = -6000; i <= 6000; ++i) {
      const double light = i / 4000.0;
      EXPECT_NEAR(decode(transfer, encode(transfer, light)), light, tolerance) << name_of(transfer);
    }
  }
}

TEST(Decode, IsOddAndRisesStrictlyFromBelowZeroToAboveOne) {
  for (const Transfer transfer : transfers) {
    EXPECT_EQ(decode(transfer, 0), 0);
    EXPECT_DOUBLE_EQ(decode(transfer, 1), 1);
    double before = decode(transfer, -1.501);
    for (int i = -1500; i <= 1500; ++i) {
      const double value = i / 1000.0;
      const double light = decode(transfer, value);
      EXPECT_GT(light, before) << name_of(transfer) << " at " << value;
      EXPECT_EQ(decode(transfer, -value), -light);
      before = light;
    }
  }
}

TEST(Decode, GivesThePublishedValues) {
  EXPECT_NEAR(decode(Transfer::rec1886, 0.5), 0.18946457, 1e-8);
  EXPECT_NEAR(decode(Transfer::srgb, 0.5), 0.21404114, 1e-8);
  EXPECT_NEAR(decode(Transfer::srgb, 0.04), 0.04 / 12.92, 1e-15);
  EXPECT_NEAR(decode(Transfer::rec709_camera, 0.5), 0.25964, 1e-4);
  EXPECT_NEAR(decode(Transfer::rec709_camera, 0.045), 0.01, 1e-15);
  EXPECT_EQ(decode(Transfer::linear, 0.5), 0.5);
}

TEST(TransferFromName, KnowsEveryName) {
  for (const Transfer transfer : transfers) {
    EXPECT_EQ(transfer_from_name(name_of(transfer)), transfer);
  }
}

TEST(TransferFromName, ListsTheNamesWhenItRefuses) {
  try {
    transfer_from_name("rec709");
    FAIL() << "took a name that is none";
  } catch (const std::invalid_argument& error) {
    for (const Transfer transfer : transfers) {
      EXPECT_THAT(error.what(), testing::HasSubstr(std::string(name_of(transfer))));
    }
  }
}

}  // namespace
}  // namespace capture::colour_test
