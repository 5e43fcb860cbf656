// Helper programs: their output arrives, their endings are told, they never hold us up.
#include "capture/sandbox.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <new>
#include <stdexcept>
#include <vector>

#include "tests/made_files.h"

namespace capture::sandbox_test {
namespace {

using std::chrono::milliseconds;

// Programs of the tests are shell scripts.
std::string script(const std::string& lines) {
  const std::string path = made::make_temporary_directory() / "program";
  std::ofstream(path) << "#!/bin/sh\n" << lines << "\n";
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  return path;
}

struct NoInput {
  int fd = open("/dev/null", O_RDONLY | O_CLOEXEC);
  ~NoInput() { close(fd); }
};

TEST(SandboxedChild, DeliversItsOutputAndAGoodEnding) {
  const NoInput input;
  SandboxedChild child(script("printf hello"), input.fd, milliseconds(10'000));
  std::array<char, 5> text{};
  EXPECT_TRUE(child.read(std::as_writable_bytes(std::span(text))));
  EXPECT_EQ(std::string(text.data(), text.size()), "hello");
  EXPECT_EQ(child.ending(), "");
}

TEST(SandboxedChild, ReadsTheFileItIsGiven) {
  const std::string path = made::make_temporary_directory() / "input";
  std::ofstream(path) << "abc";
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  SandboxedChild child("/bin/cat", fd, milliseconds(10'000));
  close(fd);
  std::array<char, 3> text{};
  EXPECT_TRUE(child.read(std::as_writable_bytes(std::span(text))));
  EXPECT_EQ(std::string(text.data(), text.size()), "abc");
}

TEST(SandboxedChild, IsWrittenToAndAnswers) {
  SandboxedChild child(script("head -c 3"), milliseconds(10'000));
  EXPECT_TRUE(child.write(std::as_bytes(std::span("abcdef").first(6))));
  std::array<char, 3> text{};
  EXPECT_TRUE(child.read(std::as_writable_bytes(std::span(text))));
  EXPECT_EQ(std::string(text.data(), text.size()), "abc");
}

TEST(SandboxedChild, TakesNoMoreOnceItHasEnded) {
  SandboxedChild child(script("exit 0"), milliseconds(10'000));
  const std::vector<std::byte> much(std::size_t{10} << 20);
  EXPECT_FALSE(child.write(much));
  EXPECT_EQ(child.ending(), "");
}

TEST(SandboxedChild, IsGivenUpWhenItDoesNotListen) {
  SandboxedChild child(script("exec sleep 100"), milliseconds(50));
  const std::vector<std::byte> much(std::size_t{10} << 20);
  EXPECT_THROW(child.write(much), std::runtime_error);
}

TEST(SandboxedChild, TellsACrashFromAFailure) {
  const NoInput input;
  SandboxedChild failed(script("exit 3"), input.fd, milliseconds(10'000));
  EXPECT_EQ(failed.ending(), "the helper program ended with status 3");
  SandboxedChild crashed(script("kill -SEGV $$"), input.fd, milliseconds(10'000));
  EXPECT_EQ(crashed.ending(), "the helper program crashed (SIGSEGV)");
  std::array<std::byte, 1> byte{};
  EXPECT_FALSE(crashed.read(byte));
}

TEST(SandboxedChild, IsGivenUpWhenItsTimeIsOver) {
  const NoInput input;
  const auto start = std::chrono::steady_clock::now();
  {
    SandboxedChild child(script("exec sleep 100"), input.fd, milliseconds(50));
    std::array<std::byte, 1> byte{};
    EXPECT_THROW(child.read(byte), std::runtime_error);
  }  // killed and reaped
  EXPECT_LT(std::chrono::steady_clock::now() - start, milliseconds(5000));
}

TEST(SandboxedChild, InheritsNoOtherFileAndNoEnvironment) {
  const NoInput input;
  const int open_elsewhere = open("/dev/null", O_RDONLY);  // without close-on-exec
  SandboxedChild child(
      script("n=0; for f in /proc/self/fd/*; do n=$((n+1)); done; echo $n; echo \"[$HOME]\""),
      input.fd, milliseconds(10'000));
  std::array<char, 5> text{};
  EXPECT_TRUE(child.read(std::as_writable_bytes(std::span(text))));
  close(open_elsewhere);
  // Standard input, output, error; the script itself; the directory being listed.
  EXPECT_LE(text[0], '5');
  EXPECT_EQ(std::string(text.data() + 1, 4), "\n[]\n");
}

TEST(SandboxedChild, SaysWhichProgramDoesNotStart) {
  const NoInput input;
  try {
    SandboxedChild child("/nowhere/program", input.fd, milliseconds(1000));
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/program"), std::string::npos);
  }
}

TEST(ConfineThisProcess, LeavesComputingButNoFilesAndNoMemoryBeyondTheLimit) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizer needs what the sandbox takes";
#endif
  // In a process of its own, which answers by its exit status.
  EXPECT_EXIT(
      {
        confine_this_process({.memory_bytes = std::size_t{512} << 20});
        const bool files_closed = open("/etc/passwd", O_RDONLY) < 0 && errno == EPERM;
        bool memory_limited = false;
        try {
          std::vector<std::byte> much(std::size_t{600} << 20);
        } catch (const std::bad_alloc&) {
          memory_limited = true;
        }
        const std::vector<std::byte> little(std::size_t{10} << 20);
        _exit(files_closed && memory_limited && !little.empty() ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
}

TEST(HelperPath, FindsTheDecoder) {
  EXPECT_EQ(access(helper_path("platelight-decode").c_str(), X_OK), 0);
  EXPECT_THROW(helper_path("platelight-nothing"), std::runtime_error);
}

}  // namespace
}  // namespace capture::sandbox_test
