// platelight-model: reads a model that its parent hands it, confined, and sends it back as plain
// arrays (model_wire.h). A damaged file may crash it; that is what it is for.
#include <algorithm>
#include <chrono>
#include <exception>
#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "capture/helper_io.h"
#include "capture/sandbox.h"
#include "render/model_import.h"
#include "render/model_process.h"
#include "render/model_wire.h"

namespace {

namespace wire = render::wire;

using capture::read_value, capture::write_all;

std::vector<std::byte> read_bytes(std::uint64_t count) {
  std::vector<std::byte> bytes(count);
  capture::read_all(bytes);
  return bytes;
}

void send(wire::Kind kind, std::span<const std::byte> payload) {
  capture::send_message<wire::Prefix>(kind, payload);
}
void send(wire::Kind kind, const std::string& text) {
  send(kind,
       std::as_bytes(std::span(text).first(std::min<std::size_t>(text.size(), wire::max_text))));
}

// Files that the parent hands out.
class ParentsFiles : public render::ModelFiles {
 public:
  std::optional<std::vector<std::byte>> read(const std::string& reference) override {
    send(wire::Kind::open, reference);
    const auto answer = read_value<wire::Answer>();
    if (answer.found == 0) return std::nullopt;
    return read_bytes(answer.bytes);
  }
  bool exists(const std::string& reference) override {
    send(wire::Kind::exists, reference);
    return read_value<wire::Answer>().found != 0;
  }
};

void send(const render::RawModel& model) {
  const std::vector<std::byte> head = write_head(model);
  if (head.size() > wire::max_head) throw std::runtime_error("it has too many parts");
  send(wire::Kind::head, head);
  for (const render::Mesh& mesh : model.meshes) {
    for_each_vertex_array(mesh,
                          [](const auto& values) { write_all(std::as_bytes(std::span(values))); });
    write_all(std::as_bytes(std::span(mesh.triangles)));
  }
  for (const render::RawTexture& texture : model.textures) write_all(texture.bytes);
}

std::string in_megabytes(std::uint64_t bytes) { return std::to_string(bytes >> 20U) + " MB"; }

}  // namespace

int main() {
  try {
    wire::Limits limits;
    try {
      limits = read_value<wire::Limits>();
      capture::confine_this_process({static_cast<std::size_t>(limits.memory_bytes),
                                     std::chrono::seconds(static_cast<long>(limits.processor_s))});
      std::string file;
      const render::LoadOptions options =
          render::parse_request(read_bytes(limits.request_bytes), file);
      ParentsFiles files;
      send(import_model(files, file, options));
      return 0;
    } catch (const std::invalid_argument& error) {
      send(wire::Kind::wrong_option, error.what());
    } catch (const std::bad_alloc&) {
      send(wire::Kind::failure, "it needs more than the " + in_megabytes(limits.memory_bytes) +
                                    " that a file of its size may take: is it damaged?");
    } catch (const std::exception& error) {
      send(wire::Kind::failure, error.what());
    }
    return 1;
  } catch (const std::exception&) {
    return 2;  // nobody listens
  }
}
