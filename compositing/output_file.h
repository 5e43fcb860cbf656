// A file that libav writes through, which knows how far it was written whole.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

struct AVIOContext;

namespace compositing {

// Whether two paths name one file, there or yet to be written, links followed.
bool is_one_file(const std::string& a, const std::string& b);

// Whether a file could be written here, and nobody else writes it now. What is there stays as it
// is, and what is not is not left there. Throws std::runtime_error with path and reason if it could
// not.
void require_writable(const std::string& path);

// Whether a folder is there that can be written to, or can be made. Makes nothing. Throws as
// require_writable.
void require_writable_folder(const std::string& path);

// Keeps others of its kind, of any program, from a folder for as long as it lives.
class FolderLock {
 public:
  // Throws std::runtime_error with path and reason if another one has it, or it cannot be opened.
  explicit FolderLock(const std::string& folder);
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  ~FolderLock();

 private:
  int descriptor_;
};

class OutputFile {
 public:
  // Creates or replaces the file, and keeps others of its kind, of any program, from it. What was
  // there is lost by the first bytes that are written; without any, nothing new is left there.
  // Throws std::runtime_error with path and reason.
  explicit OutputFile(const std::string& path);
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();

  AVIOContext* context() const { return context_; }

  // What is whole: so many pictures, of which `end` is the index after the last.
  struct Whole {
    std::int64_t pictures = 0, end = 0;
  };
  // Remembers that all up to here is whole, and what that is. Only the last few places are kept.
  void mark(Whole whole);

  // Up to the last place that is remembered: after cut_back(), what is left.
  Whole whole() const { return marks_.empty() ? Whole{} : marks_.back().whole; }

  // Bytes so far.
  std::int64_t place() const;

  // Throws std::runtime_error if the file was removed, and what is written is lost: with
  // `by_name`, also if it is no longer found by its path. Of pipes and devices it says nothing.
  void require_there(bool by_name) const;
  // Of a regular file, whether it has no name any more.
  bool is_removed() const;

  // After it was cut back to `place` and ended anew: what it says of itself counts `length_s`.
  void shorten(std::int64_t place, double length_s) const noexcept;

  // Clears a failed write. While discarding, writes seem to succeed and go nowhere.
  void discard(bool discarding) noexcept;

  // Cuts the file back to the last mark after which `room` more bytes can be written, and lets
  // libav write there again. If there is no such mark, cuts it back to the first one that is known
  // and returns false. Marks beyond are forgotten.
  bool cut_back(std::int64_t room) noexcept;

  // Cuts the file back to a place. Whether `room` more bytes can be written there by libav.
  bool cut_to(std::int64_t place, std::int64_t room) noexcept;

 private:
  struct Mark {
    std::int64_t place = 0;
    Whole whole;
  };

  static int write(void* file, std::uint8_t* data, int size);
  bool begin() noexcept;
  void leave() noexcept;
  bool has_room(std::int64_t place, std::int64_t room) noexcept;
  static std::int64_t seek(void* file, std::int64_t offset, int whence);

  std::string path_;
  int descriptor_ = -1;
  bool made_ = false;   // it was not there
  bool begun_ = false;  // what was there is gone
  AVIOContext* context_ = nullptr;
  std::vector<Mark> marks_;
  bool discarding_ = false;
};

}  // namespace compositing
