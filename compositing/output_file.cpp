// A file that libav writes through, which knows how far it was written whole.
#include "compositing/output_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <system_error>

#include "compositing/matroska_mend.h"

extern "C" {
#include <libavformat/avio.h>
#include <libavutil/error.h>
#include <libavutil/mem.h>
}

namespace compositing {
namespace {

constexpr int buffer_size = 1 << 16;
constexpr std::size_t marks_kept = 8;

struct Opened {
  int descriptor = -1;
  bool made = false;  // it was not there
};

// Until it is closed. Any failure but one is a file system that has no locks.
void lock(int descriptor, const std::string& path, const char* other) {
  if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  ::close(descriptor);
  throw std::runtime_error(path + ": is being written by another program: name another " + other +
                           ", or wait until that one has ended");
}

// As it is, and locked until it is closed: two who write to one file destroy it for each other.
// Whoever removes it holds the lock.
Opened open_to_write(const std::string& path) {
  constexpr int how = O_WRONLY | O_CREAT | O_CLOEXEC;
  while (true) {
    int descriptor = ::open(path.c_str(), how | O_EXCL, 0666);
    const bool made = descriptor >= 0;
    // Opening a pipe would wait for its reader.
    if (!made && errno == EEXIST) descriptor = ::open(path.c_str(), how | O_NONBLOCK, 0666);
    if (descriptor < 0 && errno == ENXIO) {
      throw std::runtime_error(path + ": nobody reads from this pipe: start its reader first");
    }
    if (descriptor < 0) {
      throw std::runtime_error(path +
                               ": cannot be written: " + std::generic_category().message(errno));
    }
    ::fcntl(descriptor, F_SETFL, ::fcntl(descriptor, F_GETFL) & ~O_NONBLOCK);
    struct stat found {};
    if (::fstat(descriptor, &found) != 0 || !S_ISREG(found.st_mode)) return {descriptor, made};
    lock(descriptor, path, "file");
    if (::fstat(descriptor, &found) != 0 || found.st_nlink > 0) return {descriptor, made};
    ::close(descriptor);  // who asked whether it could be written has removed it meanwhile
  }
}

}  // namespace

bool is_one_file(const std::string& a, const std::string& b) {
  const auto whole = [](const std::string& path) {
    std::error_code failed;  // where a folder cannot be looked into; opening tells
    const std::filesystem::path absolute = std::filesystem::absolute(path, failed);
    std::filesystem::path real = std::filesystem::weakly_canonical(absolute, failed);
    return failed ? absolute.lexically_normal() : real;
  };
  std::error_code failed;  // where either is not there
  return whole(a) == whole(b) || std::filesystem::equivalent(a, b, failed);  // by another link
}

void require_writable(const std::string& path) {
  struct stat found {};
  // A pipe's reader would take that it is closed again for its end.
  if (::stat(path.c_str(), &found) == 0 && S_ISFIFO(found.st_mode)) {
    if (::access(path.c_str(), W_OK) == 0) return;
    throw std::runtime_error(path +
                             ": cannot be written: " + std::generic_category().message(errno));
  }
  const Opened opened = open_to_write(path);
  if (opened.made) ::unlink(path.c_str());
  ::close(opened.descriptor);
}

FolderLock::FolderLock(const std::string& folder)
    : descriptor_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (descriptor_ < 0) {
    throw std::runtime_error(folder +
                             ": cannot be opened: " + std::generic_category().message(errno));
  }
  lock(descriptor_, folder, "folder");
}

FolderLock::~FolderLock() { ::close(descriptor_); }

void require_writable_folder(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code none;
  fs::path there = fs::absolute(path, none).lexically_normal();
  while (!there.empty() && there != there.root_path() &&
         !fs::exists(fs::symlink_status(there, none))) {
    there = there.parent_path();
  }
  if (!fs::is_directory(there, none)) {
    throw std::runtime_error(path + ": cannot be made: " + there.string() + " is no folder");
  }
  if (::access(there.c_str(), W_OK | X_OK) != 0) {
    throw std::runtime_error(path + ": cannot be written to: " + there.string() + ": " +
                             std::generic_category().message(errno));
  }
  if (fs::equivalent(there, path, none)) FolderLock{path};  // nobody writes it now
}

OutputFile::OutputFile(const std::string& path) : path_(path) {
  const Opened opened = open_to_write(path);
  descriptor_ = opened.descriptor;
  made_ = opened.made;
  auto* const buffer = static_cast<unsigned char*>(av_malloc(buffer_size));
  if (buffer != nullptr) {
    // A pipe's reader has what is written.
    const bool seeks = ::lseek(descriptor_, 0, SEEK_CUR) >= 0;
    context_ = avio_alloc_context(buffer, buffer_size, 1, this, nullptr, &OutputFile::write,
                                  seeks ? &OutputFile::seek : nullptr);
  }
  if (context_ == nullptr) {
    av_free(buffer);
    leave();
    throw std::bad_alloc();
  }
}

OutputFile::~OutputFile() {
  av_freep(&context_->buffer);
  avio_context_free(&context_);
  leave();
}

void OutputFile::leave() noexcept {
  if (made_ && !begun_) ::unlink(path_.c_str());
  ::close(descriptor_);
}

// EINVAL is a device or pipe, of which nothing can be cut.
bool OutputFile::begin() noexcept {
  if (!begun_) begun_ = ::ftruncate(descriptor_, 0) == 0 || errno == EINVAL;
  return begun_;
}

int OutputFile::write(void* file, std::uint8_t* data, int size) {
  auto* const self = static_cast<OutputFile*>(file);
  if (self->discarding_) return size;
  if (!self->begin()) return AVERROR(errno);
  const int descriptor = self->descriptor_;
  for (int done = 0; done < size;) {
    const ssize_t count = ::write(descriptor, data + done, static_cast<std::size_t>(size - done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return AVERROR(errno);
    done += static_cast<int>(count);
  }
  return size;
}

std::int64_t OutputFile::seek(void* file, std::int64_t offset, int whence) {
  const int descriptor = static_cast<OutputFile*>(file)->descriptor_;
  if (whence == AVSEEK_SIZE) return AVERROR(ENOSYS);
  const off_t place = ::lseek(descriptor, offset, whence & ~AVSEEK_FORCE);
  return place < 0 ? AVERROR(errno) : place;
}

std::int64_t OutputFile::place() const { return avio_tell(context_); }

bool OutputFile::is_removed() const {
  struct stat written {};
  return ::fstat(descriptor_, &written) == 0 && S_ISREG(written.st_mode) && written.st_nlink == 0;
}

void OutputFile::require_there(bool by_name) const {
  struct stat written {
  }, named{};
  if (::fstat(descriptor_, &written) != 0 || !S_ISREG(written.st_mode)) return;
  if (written.st_nlink == 0)
    throw std::runtime_error(path_ + ": was removed while it was written: what was in it is lost");
  if (!by_name || !begun_) return;
  const bool is_there = ::stat(path_.c_str(), &named) == 0 && named.st_ino == written.st_ino &&
                        named.st_dev == written.st_dev;
  if (!is_there)
    throw std::runtime_error(path_ + ": was moved while it was written: it is whole, elsewhere");
}

void OutputFile::shorten(std::int64_t place, double length_s) const noexcept {
  std::array<char, 64> again{};
  std::snprintf(again.data(), again.size(), "/proc/self/fd/%d", descriptor_);
  const int descriptor = ::open(again.data(), O_RDWR | O_CLOEXEC);
  if (descriptor < 0) return;
  mend_cut_matroska(descriptor, place, length_s);
  ::close(descriptor);
}

void OutputFile::mark(Whole whole) {
  const std::int64_t here = place();
  if (!marks_.empty() && marks_.back().place == here) return;
  if (marks_.size() == marks_kept) marks_.erase(marks_.begin());
  marks_.push_back({here, whole});
}

void OutputFile::discard(bool discarding) noexcept {
  discarding_ = discarding;
  context_->error = 0;
}

bool OutputFile::has_room(std::int64_t place, std::int64_t room) noexcept {
  static constexpr std::array<std::uint8_t, 65536> zeros{};
  if (::ftruncate(descriptor_, place) != 0) return false;
  bool fits = true;
  for (std::int64_t done = 0; fits && done < room;) {
    const auto size = static_cast<std::size_t>(
        std::min<std::int64_t>(room - done, static_cast<std::int64_t>(zeros.size())));
    const ssize_t count = ::pwrite(descriptor_, zeros.data(), size, place + done);
    fits = count > 0;
    done += std::max<ssize_t>(count, 0);
  }
  return ::ftruncate(descriptor_, place) == 0 && fits;
}

bool OutputFile::cut_to(std::int64_t place, std::int64_t room) noexcept {
  return has_room(place, room) && avio_seek(context_, place, SEEK_SET) == place;
}

bool OutputFile::cut_back(std::int64_t room) noexcept {
  for (; !marks_.empty(); marks_.pop_back()) {
    if (cut_to(marks_.back().place, room)) return true;
    if (marks_.size() == 1) break;  // it ends there now
  }
  return false;
}

}  // namespace compositing
