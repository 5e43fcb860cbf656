// File access of a model, confined to the folder that the model lies in.
#include "render/model_folder.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <stdexcept>
#include <system_error>

namespace render {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t max_file_bytes = std::uintmax_t{2} << 30;

std::string unescaped(const std::string& uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    unsigned code = 0;
    if (uri[i] == '%' && i + 2 < uri.size()) {
      const auto [end, error] = std::from_chars(&uri[i + 1], &uri[i + 3], code, 16);
      if (error == std::errc{} && end == &uri[i + 3]) {
        text += static_cast<char>(code);
        i += 2;
        continue;
      }
    }
    text += uri[i];
  }
  return text;
}

bool lies_inside(const fs::path& file, const fs::path& folder) {
  const auto [in_folder, in_file] =
      std::mismatch(folder.begin(), folder.end(), file.begin(), file.end());
  return in_folder == folder.end() && in_file != file.end();
}

}  // namespace

ModelFolder::ModelFolder(const std::string& model_path) : model_(model_path) {
  std::error_code error;
  if (!fs::is_regular_file(model_, error))
    throw std::runtime_error(model_path + ": there is no such file");
  folder_ = fs::canonical(fs::absolute(model_).parent_path());
}

std::optional<fs::path> ModelFolder::find(const std::string& reference) const {
  const auto refuse = [&](const std::string& why) {
    throw std::runtime_error(model_.string() + ": it refers to '" + reference + "', " + why);
  };
  if (reference.find('\0') != std::string::npos) refuse("which is no file name");
  if (reference.find("://") != std::string::npos)
    refuse("which is not a file; put the file beside the model");
  std::error_code error;
  for (std::string candidate : {reference, unescaped(reference)}) {
    if (candidate.find('\0') != std::string::npos) continue;
    std::replace(candidate.begin(), candidate.end(), '\\', '/');
    const fs::path path = fs::weakly_canonical(folder_ / candidate, error);
    if (error) continue;
    if (!lies_inside(path, folder_)) refuse("which lies outside the model's folder");
    if (fs::is_regular_file(path, error)) return path;
  }
  return std::nullopt;
}

fs::path ModelFolder::resolve(const std::string& reference) const {
  if (const auto path = find(reference)) return *path;
  throw std::runtime_error(model_.string() + ": it refers to '" + reference +
                           "', which is not there");
}

std::vector<std::byte> ModelFolder::read(const fs::path& path) const {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) throw std::runtime_error(path.string() + ": " + error.message());
  if (size > max_file_bytes)
    throw std::runtime_error(path.string() + ": larger than 2 GB, the most that is read");
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!file || file.gcount() != static_cast<std::streamsize>(bytes.size()))
    throw std::runtime_error(path.string() + ": cannot be read");
  return bytes;
}

}  // namespace render
