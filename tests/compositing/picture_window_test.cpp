// Parts of live pictures.
#include "compositing/picture_window.h"

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <stdexcept>

#include "compositing/keyed_picture.h"

namespace compositing::picture_window_test {
namespace {

// Somebody of alpha .8 in the middle third.
std::shared_ptr<const render::LivePicture> picture() {
  capture::Image image = capture::make_image(96, 192, 4);
  for (int y = 32; y < 64; ++y) {
    for (int x = 64; x < 128; ++x) {
      image.at(y, x, 0) = static_cast<float>(x) / 300;
      image.at(y, x, 1) = static_cast<float>(y) / 300;
      image.at(y, x, 3) = 0.8F;
    }
  }
  return std::make_shared<KeyedPicture>(make_keyed_texture(image), true);
}

TEST(PictureWindow, ShowsWhatThePictureHasThere) {
  const auto whole = picture();
  constexpr Window window{0.25F, 0.125F, 0.75F, 0.625F};
  const auto part = see_through(window, whole);
  int clear = 0, solid = 0;
  for (int i = 0; i <= 16; ++i) {
    for (int j = 0; j <= 16; ++j) {
      for (const float footprint : {0.0F, 0.01F, 0.3F}) {
        const float u = static_cast<float>(i) / 16, v = static_cast<float>(j) / 16;
        const float x = 0.25F + u / 2, y = 0.125F + v / 2;
        EXPECT_EQ(part->look_up(u, v, footprint), whole->look_up(x, y, footprint / 2));
        EXPECT_EQ(part->quick_alpha(u, v, footprint), whole->quick_alpha(x, y, footprint / 2));
        EXPECT_EQ(part->is_clear(u, v, footprint), whole->is_clear(x, y, footprint / 2));
        clear += part->is_clear(u, v, footprint);
        solid += part->look_up(u, v, footprint)[3] > 0.79F;
      }
    }
  }
  EXPECT_GT(clear, 20);
  EXPECT_GT(solid, 20);
  EXPECT_EQ(part->most_alpha(0, 0, 0.1F, 0.1F), whole->most_alpha(0.25F, 0.125F, 0.3F, 0.175F));
  EXPECT_EQ(part->most_alpha(0, 0, 1, 1), whole->most_alpha(0.25F, 0.125F, 0.75F, 0.625F));
}

TEST(PictureWindow, OfAllIsThePictureItself) {
  const auto whole = picture();
  EXPECT_EQ(see_through({}, whole), whole);
}

TEST(PictureWindow, RefusesWhatIsNoPart) {
  const auto whole = picture();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const Window& bad : {Window{0.5F, 0, 0.5F, 1}, Window{-0.1F, 0, 1, 1}, Window{0, 0, 1, 1.1F},
                            Window{0, 0.6F, 1, 0.5F}, Window{nan, 0, 1, 1}}) {
    EXPECT_THROW(see_through(bad, whole), std::invalid_argument);
  }
  EXPECT_THROW(see_through({}, nullptr), std::invalid_argument);
}

}  // namespace
}  // namespace compositing::picture_window_test
