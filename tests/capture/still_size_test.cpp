// Sizes that pictures claim.
#include "capture/still_size.h"

#include <gtest/gtest.h>

#include <string>

#include "capture/files.h"
#include "tests/made_files.h"

namespace capture::still_size_test {
namespace {

using namespace std::string_literals;
using Size = std::array<std::size_t, 2>;

std::optional<Size> size_of(const std::string& bytes) {
  return claimed_size(std::as_bytes(std::span(bytes)));
}

TEST(ClaimedSize, IsWhatTheHeaderSays) {
  EXPECT_EQ(claimed_size(read_file(made::bad_files().parent_path() / "one_texel.png", 1000)),
            (Size{1, 1}));
  EXPECT_EQ(claimed_size(read_file(made::bad_files() / "side_of_a_million.png", 100'000'000)),
            (Size{1'000'000, 1'000'000}));
  // A segment that is passed over, fill bytes, a frame of 300 x 7.
  EXPECT_EQ(size_of("\xff\xd8\xff\xe0\0\4ab\xff\xff\xc2\0\x0b\x08\0\7\1\x2c\3"s), (Size{300, 7}));
}

TEST(ClaimedSize, IsNothingWhereTheHeaderEndsOrIsNone) {
  for (const std::string& bytes :
       {""s, "text"s, "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0"s, "\xff\xd8"s,
        "\xff\xd8\xff\xe0\xff\xff"s, "\xff\xd8\xff\xe0\0\0\xff\xe0\0\0\xff\xe0\0\0\xff"s,
        "\xff\xd8garbage, much of it"s}) {
    EXPECT_EQ(size_of(bytes), std::nullopt);
  }
}

}  // namespace
}  // namespace capture::still_size_test
