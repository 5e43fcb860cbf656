// Models read by a helper program: our end.
#include "render/model_process.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include "capture/sandbox.h"
#include "render/model_format.h"
#include "render/model_wire.h"

namespace render {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr std::uint64_t least_memory = std::uint64_t{512} << 20,
                        most_memory = std::uint64_t{8} << 30;
constexpr std::uint64_t memory_per_byte = 24;
constexpr std::uint64_t least_s = 5;
constexpr std::uint64_t bytes_per_s = 1U << 20;
constexpr std::uint64_t patience = 4;  // on a busy machine: real time over processor time
constexpr std::uint64_t most_served = std::uint64_t{4} << 30;
constexpr int most_questions = 10000;
constexpr int most_files_beside = 100000;  // that are looked at

std::string ending_of(const fs::path& path) { return in_small_letters(path.extension().string()); }

// Bytes of the model and of what lies in its folder or below that it may want: buffers, material
// libraries.
std::uint64_t bytes_beside(const ModelFolder& folder) {
  std::error_code error;
  std::uint64_t bytes = fs::file_size(folder.model(), error);
  const std::string ending = ending_of(folder.model());
  if (ending != ".gltf" && ending != ".obj") return bytes;
  const fs::path beside = fs::absolute(folder.model()).parent_path();
  constexpr auto unreadable = fs::directory_options::skip_permission_denied;
  fs::recursive_directory_iterator at(beside, unreadable, error), end;
  for (int seen = 0; !error && at != end && seen < most_files_beside; ++seen, at.increment(error)) {
    const std::string other = ending_of(at->path());
    std::error_code of_file;
    if ((other == ".bin" || other == ".mtl") && at->is_regular_file(of_file)) {
      bytes += at->file_size(of_file);
    }
  }
  return bytes;
}

class Conversation {
 public:
  Conversation(const ModelFolder& folder, const LoadOptions& options, const std::stop_token& stop)
      : folder_(folder),
        input_bytes_(std::min(bytes_beside(folder), most_served)),
        processor_s_(least_s + input_bytes_ / bytes_per_s),
        child_(capture::helper_path("platelight-model"),
               milliseconds(1000 * patience * processor_s_)) {
    child_.give_up_on(stop);
    const auto request = write_request(folder.model().filename().string(), options);
    const wire::Limits limits{std::min(least_memory + memory_per_byte * input_bytes_, most_memory),
                              processor_s_, request.size()};
    say(limits);
    say_bytes(request);
  }

  RawModel model() {
    for (int questions = 0;;) {
      const wire::Prefix prefix = next();
      if (prefix.kind == wire::Kind::head) return receive(prefix.bytes);
      if (prefix.bytes > wire::max_text) go_wrong();
      const std::string text = text_of(prefix.bytes);
      switch (prefix.kind) {
        case wire::Kind::failure:
          throw std::runtime_error(printable(text));
        case wire::Kind::wrong_option:
          throw std::invalid_argument(printable(text));
        case wire::Kind::open:
        case wire::Kind::exists:
          if (++questions > most_questions) throw std::runtime_error("it asks for too many files");
          answer(text, prefix.kind == wire::Kind::open);
          break;
        default:
          go_wrong();
      }
    }
  }

 private:
  [[noreturn]] static void go_wrong() { throw std::runtime_error("its reader went wrong"); }

  // The helper has stopped talking.
  [[noreturn]] void lose() {
    const std::string ending = child_.ending();
    if (ending.find("crash") != std::string::npos) {
      throw std::runtime_error("it is damaged: " + ending +
                               " on it; export it anew, or in another format");
    }
    if (ending.find("too much time") != std::string::npos) {
      throw std::runtime_error("reading it takes more than the " + std::to_string(processor_s_) +
                               " s that a file of its size may take: is it damaged?");
    }
    if (ending.empty()) go_wrong();
    throw std::runtime_error(ending);
  }

  template <class T>
  void say(const T& value) {
    say_bytes(std::as_bytes(std::span(&value, 1)));
  }
  void say_bytes(std::span<const std::byte> bytes) {
    if (!child_.write(bytes)) lose();
  }

  void hear(std::span<std::byte> bytes) {
    if (!child_.read(bytes)) lose();
  }
  wire::Prefix next() {
    wire::Prefix prefix;
    hear(std::as_writable_bytes(std::span(&prefix, 1)));
    return prefix;
  }
  std::string text_of(std::uint32_t bytes) {
    std::string text(bytes, ' ');
    hear(std::as_writable_bytes(std::span(text)));
    return text;
  }
  // A helper that was taken over must not write to the operator's terminal.
  static std::string printable(std::string text) {
    std::replace_if(
        text.begin(), text.end(),
        [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }, '?');
    return text;
  }

  void answer(const std::string& name, bool open) {
    const auto path = folder_.find(name);
    if (!path || !open) return say(wire::Answer{path.has_value(), 0});
    const std::vector<std::byte> bytes = folder_.read(*path);
    served_ += bytes.size();
    if (served_ > most_served) throw std::runtime_error("its files are larger than 4 GB");
    say(wire::Answer{1, bytes.size()});
    say_bytes(bytes);
  }

  // Memory follows what really arrives.
  template <class T>
  void hear_all(std::vector<T>& values, std::uint64_t count) {
    constexpr std::uint64_t step = 1U << 20;
    values.reserve(static_cast<std::size_t>(count));
    while (values.size() < count) {
      const std::size_t before = values.size();
      values.resize(before + static_cast<std::size_t>(std::min(step, count - before)));
      hear(std::as_writable_bytes(std::span(values).subspan(before)));
    }
  }

  RawModel receive(std::uint32_t head_bytes) {
    if (head_bytes > wire::max_head) go_wrong();
    std::vector<std::byte> head;
    hear_all(head, head_bytes);
    RawModel model;
    const RawSizes sizes = parse_head(head, model);
    for (std::size_t i = 0; i < model.meshes.size(); ++i) {
      Mesh& mesh = model.meshes[i];
      const std::uint64_t* count = sizes.meshes[i].of_vertices.data();
      for_each_vertex_array(mesh, [&](auto& values) { hear_all(values, *count++); });
      hear_all(mesh.triangles, sizes.meshes[i].triangles);
      check_arrays(mesh);
    }
    for (std::size_t i = 0; i < model.textures.size(); ++i) {
      hear_all(model.textures[i].bytes, sizes.textures[i]);
    }
    if (const std::string ending = child_.ending(); !ending.empty()) {
      throw std::runtime_error(ending);
    }
    return model;
  }

  const ModelFolder& folder_;
  std::uint64_t input_bytes_;
  std::uint64_t processor_s_;
  std::uint64_t served_ = 0;
  capture::SandboxedChild child_;
};

}  // namespace

RawModel read_model_confined(const ModelFolder& folder,
                             const LoadOptions& options,
                             const std::stop_token& stop) {
  return Conversation(folder, options, stop).model();
}

}  // namespace render
