// Whole files: read with a limit, written whole or not at all.
#include "capture/files.h"

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <system_error>

namespace capture {
namespace {

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

std::runtime_error failure(const std::string& path, const std::string& what, int error) {
  return std::runtime_error(path + ": " + what + ": " + std::generic_category().message(error));
}

}  // namespace

std::vector<std::byte> read_file(const std::string& path, std::size_t max_bytes) {
  std::error_code error;
  if (std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error)) {
    throw std::runtime_error(path + ": is no file");
  }
  const File file(std::fopen(path.c_str(), "rbe"), &std::fclose);
  if (!file) throw failure(path, "cannot be opened", errno);
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) throw failure(path, "has no size", error.value());
  if (size > max_bytes) {
    throw std::runtime_error(path + ": has " + std::to_string(size) +
                             " bytes, which is more than the limit of " +
                             std::to_string(max_bytes));
  }
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  bytes.resize(std::fread(bytes.data(), 1, bytes.size(), file.get()));
  if (std::ferror(file.get()) != 0) throw failure(path, "cannot be read", errno);
  return bytes;
}

void write_file(const std::string& path, std::span<const std::byte> bytes) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status there = fs::status(path, error);
  const fs::path real = fs::weakly_canonical(path, error);
  const std::string target = error ? path : real.string();
  const std::string partial = target + ".part";
  // What a shell has sent /dev/stdout to is a file, but more may follow.
  bool in_place = path.starts_with("/dev/") || (fs::exists(there) && !fs::is_regular_file(there));
  File file(std::fopen(in_place ? target.c_str() : partial.c_str(), "wbe"), &std::fclose);
  if (!file && errno == EACCES && fs::exists(there)) {  // the file may be written, its folder not
    in_place = true;
    file.reset(std::fopen(target.c_str(), "wbe"));
  }
  if (!file) throw failure(path, "cannot be written", errno);
  const bool written =
      bytes.empty() || std::fwrite(bytes.data(), 1, bytes.size(), file.get()) == bytes.size();
  int failed = written ? 0 : errno;
  if (std::fclose(file.release()) != 0 && failed == 0) failed = errno;
  if (failed == 0 && !in_place && std::rename(partial.c_str(), target.c_str()) != 0) failed = errno;
  if (failed == 0) return;
  if (!in_place) std::remove(partial.c_str());
  throw failure(path, "cannot be written", failed);
}

}  // namespace capture
