// Files of one picture as its camera sent it: the recording's own form, which loses nothing.
#pragma once

#include <memory>
#include <string>

#include "capture/coded_picture.h"
#include "capture/image.h"
#include "capture/linearise.h"

namespace capture {

// Whether the name ends as such files' names do: .coded.
bool is_coded_file(const std::string& path);

// A header of 48 bytes, little-endian: "PLCODED1", then the layout's eight numbers in their order,
// 32 bits each, and the count of the bytes that follow, 64 bits. Throws std::runtime_error with
// path and reason.
void write_coded_file(const std::string& path, const CodedPicture& picture);

// Throws std::runtime_error with path and reason if the file is cut short, too long, no such file,
// or of a picture without a size. Whether its bytes are a picture, reading them tells.
CodedPicture read_coded_file(const std::string& path);

// Reads such files as light, one after the other. Keeps tables between pictures that are alike.
// Not thread-safe.
class CodedFileReader {
 public:
  explicit CodedFileReader(LightCurves curves);

  // Light of a file's whole picture, exactly as its camera gave it. Returns how it was read. Throws
  // std::runtime_error with path and reason.
  std::string read(const std::string& path, Image& image);

 private:
  LightCurves curves_;
  CodedLayout layout_;
  std::unique_ptr<CodedPictureReader> reader_;  // of layout_
};

}  // namespace capture
