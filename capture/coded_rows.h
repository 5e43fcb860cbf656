// Decoded pictures of libav as rows of R'G'B' on an integer grid. For the files that wrap libav.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "capture/picture_tags.h"
#include "capture/ycbcr.h"

struct AVFrame;

namespace capture {

struct RowReader;

// R'G'B' of one row: indices of a ValueGrid, one array per channel. Grey has one array three times.
using CodedRow = std::array<const std::int32_t*, 3>;

// Reads rows of pictures that are all alike (see are_alike). The arithmetic is in colour.md.
// Not thread-safe.
class CodedRows {
 public:
  // Takes size, format and tags from `frame`.
  // Throws std::runtime_error, without a file name, if format or tags are of a kind not handled.
  explicit CodedRows(const AVFrame& frame);
  ~CodedRows();

  bool fits(const AVFrame& frame) const;
  const ValueGrid& grid() const { return grid_; }
  TransferTag transfer_tag() const { return transfer_tag_; }
  const std::string& description() const { return description_; }

  // The picture that `read` reads from now on; it must fit, and stay as it is meanwhile.
  void begin(const AVFrame& frame);
  // Row y of it, all columns. The pointers stay good until the next call.
  CodedRow read(int y);

  // Row y again as it lies in the picture, if that is bytes R, G, B, R, G, B, ... of the grid's
  // indices; else null.
  const std::uint8_t* packed_rgb(int y) const;

  // Alpha, if the format has it: row y in codes 0 .. max_alpha().
  bool has_alpha() const;
  int max_alpha() const;
  const std::int32_t* read_alpha(int y);

 private:
  std::unique_ptr<RowReader> reader_;
  ValueGrid grid_;
  TransferTag transfer_tag_ = TransferTag::display;
  std::string description_;
};

}  // namespace capture
