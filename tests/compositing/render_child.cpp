// A node in miniature: reads one frame's job, scene, environment and tiles as bytes from standard
// input, and writes the tiles' halves to standard output. Part of travelling_job_test.cpp.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <span>
#include <vector>

#include "compositing/stand_in.h"
#include "render/environment_bytes.h"
#include "render/kernel.h"

namespace {

std::vector<std::byte> read_block() {
  std::uint64_t size = 0;
  if (std::fread(&size, sizeof size, 1, stdin) != 1) return {};
  std::vector<std::byte> block(size);
  if (size > 0 && std::fread(block.data(), 1, size, stdin) != size) return {};
  return block;
}

template <class T>
void write_all(const std::vector<T>& values) {
  std::fwrite(values.data(), sizeof(T), values.size(), stdout);
}

}  // namespace

int main() {
  compositing::register_shaders();
  const render::Scene scene(render::parse_scene(read_block()));
  const render::FrameJob job = render::parse_frame_job(read_block());
  const render::Environment environment = render::parse_environment(read_block());
  const std::vector<std::byte> size = read_block();
  int width_height[2];
  std::copy_n(size.data(), sizeof width_height, reinterpret_cast<std::byte*>(width_height));
  const double f = width_height[0] * 1.1;
  const auto directions = calibrate::make_direction_table(
      {"pinhole",
       width_height[0],
       width_height[1],
       {f, f, (width_height[0] - 1) / 2.0, (width_height[1] - 1) / 2.0}});
  const render::FrameContext context = make_frame_context({&scene, &directions, &environment}, job);
  render::TileWorkspace workspace;
  while (true) {
    const std::vector<std::byte> bytes = read_block();
    if (bytes.empty()) return 0;
    render::TileResult result;
    const render::TileJob tile = render::parse_tile_job(bytes);
    size_result(tile.rect, result);
    render_tile(context, tile, workspace, result);
    write_all(result.rgba);
    write_all(result.matte);
  }
}
