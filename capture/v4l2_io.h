// The system calls that drive V4L2 devices. Tests put a made device in their place.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "capture/frame.h"

namespace capture {

// Each as the system call of its name. Errors are returned as -errno; calls that a signal
// interrupted are made again.
class V4l2Io {
 public:
  virtual ~V4l2Io() = default;
  // Paths of the video nodes that there are now, by their numbers.
  virtual std::vector<std::string> nodes() = 0;
  // For reading and writing, without blocking. Returns the descriptor.
  virtual int open(const std::string& path) = 0;
  virtual void close(int descriptor) = 0;
  virtual int ioctl(int descriptor, unsigned long request, void* argument) = 0;
  // Null if it fails.
  virtual const std::byte* map(int descriptor, std::size_t bytes, std::int64_t offset) = 0;
  virtual void unmap(const std::byte* memory, std::size_t bytes) = 0;
  // Until a buffer is filled: 1; 0 if none was in time; -EIO or -ENODEV if none will be.
  virtual int wait(int descriptor, Time longest) = 0;
  virtual Time now() = 0;  // monotonic clock
  virtual void sleep(Time length) = 0;
};

// Of this machine.
std::shared_ptr<V4l2Io> system_v4l2_io();

// An open node; closes itself.
class V4l2Node {
 public:
  // Throws std::system_error, with errno's code, if it does not open.
  V4l2Node(std::shared_ptr<V4l2Io> io, const std::string& path);
  ~V4l2Node();
  V4l2Node(const V4l2Node&) = delete;
  V4l2Node& operator=(const V4l2Node&) = delete;

  V4l2Io& io() const { return *io_; }
  int descriptor() const { return descriptor_; }
  // 0 or more if it went well, else -errno.
  int call(unsigned long request, void* argument) const {
    return io_->ioctl(descriptor_, request, argument);
  }

 private:
  std::shared_ptr<V4l2Io> io_;
  int descriptor_;
};

}  // namespace capture
