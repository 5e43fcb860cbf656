// Values as bytes.
#include "render/bytes.h"

namespace render {

void ByteWriter::append(const void* data, std::size_t size) {
  const auto* from = static_cast<const std::byte*>(data);
  bytes_.insert(bytes_.end(), from, from + size);
}

}  // namespace render
