// System calls of V4L2.
#include "capture/v4l2_io.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <filesystem>
#include <system_error>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace capture {
namespace {

// Numbers of nodes that are called video and a number.
std::vector<int> node_numbers() {
  std::vector<int> numbers;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", none)) {
    const std::string name = entry.path().filename().string();
    int number = 0;
    const char* const end = name.data() + name.size();
    if (name.starts_with("video") && std::from_chars(name.data() + 5, end, number).ptr == end &&
        name.size() > 5) {
      numbers.push_back(number);
    }
  }
  std::ranges::sort(numbers);
  return numbers;
}

class SystemIo final : public V4l2Io {
 public:
  std::vector<std::string> nodes() override {
    std::vector<std::string> paths;
    for (const int number : node_numbers()) paths.push_back("/dev/video" + std::to_string(number));
    return paths;
  }

  int open(const std::string& path) override {
    return again([&] { return ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC); });
  }

  void close(int descriptor) override { ::close(descriptor); }

  int ioctl(int descriptor, unsigned long request, void* argument) override {
    return again([&] { return ::ioctl(descriptor, request, argument); });
  }

  const std::byte* map(int descriptor, std::size_t bytes, std::int64_t offset) override {
    void* const memory = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED, descriptor, offset);
    return memory == MAP_FAILED ? nullptr : static_cast<const std::byte*>(memory);
  }

  void unmap(const std::byte* memory, std::size_t bytes) override {
    ::munmap(const_cast<std::byte*>(memory), bytes);
  }

  int wait(int descriptor, Time longest) override {
    pollfd polled{descriptor, POLLIN, 0};
    const Time end = now() + longest;
    for (;;) {
      const auto left =
          std::chrono::ceil<std::chrono::milliseconds>(std::max(end - now(), Time{0}));
      const int ready = ::poll(&polled, 1, static_cast<int>(left.count()));
      if (ready < 0 && errno == EINTR) continue;
      if (ready < 0) return -errno;
      if (ready == 0) return 0;
      if ((polled.revents & (POLLHUP | POLLNVAL)) != 0) return -ENODEV;
      return (polled.revents & POLLERR) != 0 ? -EIO : 1;
    }
  }

  Time now() override { return std::chrono::steady_clock::now().time_since_epoch(); }
  void sleep(Time length) override { std::this_thread::sleep_for(length); }

 private:
  template <class Call>
  static int again(const Call& call) {
    int result = call();
    while (result < 0 && errno == EINTR) result = call();
    return result < 0 ? -errno : result;
  }
};

}  // namespace

std::shared_ptr<V4l2Io> system_v4l2_io() { return std::make_shared<SystemIo>(); }

V4l2Node::V4l2Node(std::shared_ptr<V4l2Io> io, const std::string& path)
    : io_(std::move(io)), descriptor_(io_->open(path)) {
  if (descriptor_ < 0) throw std::system_error(-descriptor_, std::generic_category());
}

V4l2Node::~V4l2Node() { io_->close(descriptor_); }

}  // namespace capture
