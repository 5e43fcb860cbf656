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
  const std::string partial = path + ".part";
  File file(std::fopen(partial.c_str(), "wbe"), &std::fclose);
  if (!file) throw failure(path, "cannot be written", errno);
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file.get()) == bytes.size();
  const bool closed = std::fclose(file.release()) == 0;
  if (!written || !closed || std::rename(partial.c_str(), path.c_str()) != 0) {
    const int error = errno;
    std::remove(partial.c_str());
    throw failure(path, "cannot be written", error);
  }
}

}  // namespace capture
