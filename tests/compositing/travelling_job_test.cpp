// A frame is rendered from values alone: another process, given the same bytes, gives the same
// bits.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "made_shot.h"
#include "render/environment_bytes.h"

namespace compositing::travelling_job_test {
namespace {

void append(std::vector<std::byte>& to, std::span<const std::byte> block) {
  const std::uint64_t size = block.size();
  const auto* head = reinterpret_cast<const std::byte*>(&size);
  to.insert(to.end(), head, head + sizeof size);
  to.insert(to.end(), block.begin(), block.end());
}

TEST(FrameJob, RendersTheSameBitsInAnotherProcess) {
  const int width = 96, height = 64;
  MadeShot shot = made_shot(width, height, shot_scene());
  shot.job.frame = 7;
  shot.job.effort.interleave = 2;
  std::vector<std::byte> bytes;
  append(bytes, serialize(shot.scene->description()));
  append(bytes, serialize(shot.job));
  append(bytes, serialize(shot.environment));
  const int size[2] = {width, height};
  append(bytes, std::as_bytes(std::span(size)));

  std::vector<capture::Half> expected;
  const render::FrameContext context = make_frame_context(shot.inputs(), shot.job);
  render::TileWorkspace workspace;
  for (int y = 0; y < height; y += 32) {
    for (int x = 0; x < width; x += 32) {
      render::TileJob tile;
      cut_tile(shot.plate, {x, y, 32, 32}, 8, tile);
      append(bytes, serialize(tile));
      render::TileResult result;
      size_result(tile.rect, result);
      render_tile(context, tile, workspace, result);
      expected.insert(expected.end(), result.rgba.begin(), result.rgba.end());
      expected.insert(expected.end(), result.matte.begin(), result.matte.end());
    }
  }

  const auto dir = std::filesystem::path(testing::TempDir()) / "travelling_job";
  std::filesystem::create_directories(dir);
  std::ofstream(dir / "in", std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  const std::string command =
      PLATELIGHT_RENDER_CHILD " < " + (dir / "in").string() + " > " + (dir / "out").string();
  ASSERT_EQ(std::system(command.c_str()), 0);
  std::ifstream out(dir / "out", std::ios::binary);
  const std::vector<char> got{std::istreambuf_iterator<char>(out), {}};
  ASSERT_EQ(got.size(), expected.size() * sizeof(capture::Half));
  EXPECT_TRUE(std::equal(got.begin(), got.end(), reinterpret_cast<const char*>(expected.data())));
}

// However tiles are cut, with or without more of the plate about them.
TEST(TileJob, IsRenderedAsTheFrameIs) {
  const int width = 90, height = 52;
  MadeShot shot = made_shot(width, height, shot_scene());
  shot.directions.sensitivity.resize(shot.directions.z.size());
  for (std::size_t i = 0; i < shot.directions.sensitivity.size(); ++i) {
    shot.directions.sensitivity[i] = 1 - 0.3F * static_cast<float>(i % 7);
  }
  render::FrameResult whole;
  render_frame(shot.inputs(), shot.job, shot.plate, whole);
  const render::FrameContext context = make_frame_context(shot.inputs(), shot.job);
  render::TileWorkspace workspace;
  for (const int margin : {0, 8}) {
    for (int y = 0; y < height; y += 32) {
      for (int x = 0; x < width; x += 48) {
        render::TileJob tile;
        cut_tile(shot.plate, {x, y, std::min(48, width - x), std::min(32, height - y)}, margin,
                 tile);
        render::TileResult result;
        size_result(tile.rect, result);
        render_tile(context, tile, workspace, result);
        for (int row = 0; row < tile.rect.height; ++row) {
          const auto from =
              static_cast<std::size_t>(row) * static_cast<std::size_t>(tile.rect.width);
          const std::size_t rgba = whole.rgba.index(y + row, x),
                            matte = whole.matte.index(y + row, x);
          const auto length = static_cast<std::size_t>(tile.rect.width);
          EXPECT_TRUE(std::equal(&result.rgba[4 * from], &result.rgba[4 * from] + 4 * length,
                                 &whole.rgba.pixels[rgba]))
              << x << ", " << y + row;
          EXPECT_TRUE(std::equal(&result.matte[from], &result.matte[from] + length,
                                 &whole.matte.pixels[matte]))
              << x << ", " << y + row;
        }
      }
    }
  }
}

TEST(RenderFrame, RefusesAPlateOfAnotherSizeThanItsPicture) {
  const MadeShot shot = made_shot(96, 64, shot_scene());
  const auto context = prepare_frame(shot.inputs(), shot.job, shot.plate);
  render::FrameResult result;
  EXPECT_THROW(render_frame(*context, made_plate(64, 80), result), std::invalid_argument);
  EXPECT_THROW(render_frame(*context, {}, result), std::invalid_argument);
  capture::HalfImage cut = shot.plate;
  cut.pixels.pop_back();
  EXPECT_THROW(render_frame(*context, cut, result), std::invalid_argument);
  EXPECT_NO_THROW(render_frame(*context, shot.plate, result));
}

}  // namespace
}  // namespace compositing::travelling_job_test
