// What helper programs read and write: all of it, or an error that says why.
#include "capture/helper_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <string>
#include <thread>
#include <vector>

namespace capture::helper_io_test {
namespace {

using testing::HasSubstr, testing::ThrowsMessage;

struct Pipe {
  std::array<int, 2> ends{-1, -1};
  Pipe() { EXPECT_EQ(pipe(ends.data()), 0); }
  ~Pipe() {
    for (const int end : ends) close(end);
  }
  void close_writing() {
    close(ends[1]);
    ends[1] = -1;
  }
};

// Much more than a pipe holds arrives in many pieces.
TEST(HelperIo, ReadsAllThatIsWritten) {
  Pipe pipe;
  std::vector<std::byte> sent(std::size_t{1} << 20);
  for (std::size_t i = 0; i < sent.size(); ++i) sent[i] = static_cast<std::byte>(i * 7 / 3);
  std::thread writer([&] { write_all(sent, pipe.ends[1]); });
  std::vector<std::byte> got(sent.size());
  read_all(got, pipe.ends[0]);
  writer.join();
  EXPECT_EQ(got, sent);
  write_value(42.5, pipe.ends[1]);
  EXPECT_EQ(read_value<double>(pipe.ends[0]), 42.5);
}

TEST(HelperIo, TellsAnEndFromAnError) {
  Pipe pipe;
  write_value('x', pipe.ends[1]);
  pipe.close_writing();
  EXPECT_THAT([&] { read_value<int>(pipe.ends[0]); },
              ThrowsMessage<std::runtime_error>(HasSubstr("ends too early")));
  EXPECT_THAT([] { read_value<int>(-1); },
              ThrowsMessage<std::system_error>(HasSubstr("cannot read: ")));
  EXPECT_THAT([] { write_value(1, -1); },
              ThrowsMessage<std::system_error>(HasSubstr("cannot write: ")));
}

}  // namespace
}  // namespace capture::helper_io_test
