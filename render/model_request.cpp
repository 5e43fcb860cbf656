// What a model is asked for, as bytes.
#include "render/bytes.h"
#include "render/model_process.h"

namespace render {

std::vector<std::byte> write_request(const std::string& file, const LoadOptions& options) {
  ByteWriter out;
  out.put_text(file);
  out.put(options.scale);
  out.put(options.emission_gain);
  out.put(options.up);
  out.put(static_cast<std::uint8_t>(options.whole));
  out.put(static_cast<std::uint64_t>(options.hide.size()));
  for (const std::string& node : options.hide) out.put_text(node);
  return out.take();
}

LoadOptions parse_request(std::span<const std::byte> bytes, std::string& file) {
  ByteReader in(bytes, "a model's request");
  LoadOptions options;
  file = in.get_text();
  in.get(options.scale);
  in.get(options.emission_gain);
  in.get(options.up);
  std::uint8_t whole = 0;
  in.get(whole);
  options.whole = whole != 0;
  for (std::size_t n = in.get_count(sizeof(std::uint64_t)); n > 0; --n) {
    options.hide.push_back(in.get_text());
  }
  in.expect_end();
  return options;
}

}  // namespace render
