// What large models take: memory from file to picture.
#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "capture/image.h"
#include "render/kept_transport.h"
#include "render/load_mesh.h"
#include "render/made_model_file.h"
#include "render/paper_scenes.h"
#include "render/renderer.h"
#include "render/standard.h"
#include "tests/made_files.h"

namespace render::model_memory_test {
namespace {

constexpr int width = 640, height = 480;

double status_mb(const std::string& field) {
  std::ifstream status("/proc/self/status");
  double kb = 0;
  for (std::string word; status >> word;) {
    if (word == field + ":") status >> kb;
  }
  return kb / 1024;
}
// Peak memory since the last call, of this process alone.
double take_peak_mb() {
  const double peak = status_mb("VmHWM");
  std::ofstream("/proc/self/clear_refs") << "5";
  return peak;
}
double helpers_peak_mb() {
  rusage usage{};
  getrusage(RUSAGE_CHILDREN, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

// A wavy sheet of 2 x n x n triangles over 1 m, with normals.
SceneDescription made_sheet(int n) {
  auto mesh = std::make_shared<Mesh>();
  for (int y = 0; y <= n; ++y) {
    for (int x = 0; x <= n; ++x) {
      const float u = static_cast<float>(x) / static_cast<float>(n);
      const float v = static_cast<float>(y) / static_cast<float>(n);
      mesh->positions.push_back({u, v, 0.05F * std::sin(9 * u) * std::cos(7 * v)});
      mesh->normals.push_back(normalize(Vec3f{-0.45F * std::cos(9 * u) * std::cos(7 * v),
                                              0.35F * std::sin(9 * u) * std::sin(7 * v), 1}));
    }
  }
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const auto a = static_cast<std::uint32_t>(y * (n + 1) + x);
      const auto b = a + static_cast<std::uint32_t>(n) + 1;
      mesh->triangles.push_back({a, a + 1, b});
      mesh->triangles.push_back({a + 1, b + 1, b});
    }
  }
  mesh->materials = {0};
  SceneDescription scene;
  scene.meshes = {mesh};
  scene.materials = {make_standard_material("sheet", {})};
  scene.instances.emplace_back().name = "sheet";
  return scene;
}

// Renders, with nothing kept from frame to frame unless told; true if anything virtual is to be
// seen.
bool shows(const Scene& scene,
           const Environment& environment,
           const LightTable& lights,
           const calibrate::Pose& cam_from_set,
           double focal_px,
           const Effort& effort = {.aa_samples = 1, .accuracy = 0.95F},
           KeptTransport* kept = nullptr) {
  const calibrate::DirectionTable directions = calibrate::make_direction_table(
      {"pinhole", width, height, {focal_px, focal_px, (width - 1) / 2.0, (height - 1) / 2.0}});
  const capture::HalfImage plate = capture::to_half(capture::make_image(height, width, 3));
  FrameJob job;
  job.cam_from_set = cam_from_set;
  job.lights = lights;
  job.effort = effort;
  FrameInputs inputs{.scene = &scene, .directions = &directions, .environment = &environment};
  inputs.kept = kept;
  FrameResult result;
  render_frame(inputs, job, plate, result);
  return result.statistics.virtual_pixels > 1000;
}

Environment grey_sky() {
  Environment sky;
  sky.radiance = capture::make_image(32, 64, 3);
  std::ranges::fill(sky.radiance.pixels, 0.5F);
  sky.seen.assign(std::size_t{32} * 64, 1);
  return sky;
}

// Five million triangles are to be loaded and rendered in 3 GB, its reader's included: 644 bytes a
// triangle. Smaller ones have the same bar, once what any picture takes is taken off.
constexpr double bytes_a_triangle = 3.0 * (1 << 30) / 5e6;

void expect_within_bar(const std::string& path, const std::string& small) {
  // What is taken once: libraries, threads, the picture, the helper program.
  const Environment sky = grey_sky();
  const calibrate::Pose pose = calibrate::look_at({0.5, -0.8, 1}, {0.5, 0.5, 0}, 0);
  ASSERT_TRUE(shows(Scene(load_model(small).scene), sky, {}, pose, 500));
  malloc_trim(0);  // what the making of the files has left must not be taken up unseen
  const double ours_before = status_mb("VmRSS"), helper_before = helpers_peak_mb();
  take_peak_mb();

  std::unique_ptr<LoadedModel> model = std::make_unique<LoadedModel>(load_model(path));
  const double reading = take_peak_mb() - ours_before + helpers_peak_mb() - helper_before;
  const std::size_t triangles = model->report.triangles;
  const Scene scene(std::move(model->scene));
  model.reset();
  EXPECT_TRUE(shows(scene, sky, {}, pose, 500));
  const double rendering = take_peak_mb() - ours_before;

  const double limit_mb = bytes_a_triangle * static_cast<double>(triangles) / (1 << 20);
  testing::Test::RecordProperty("reading_mb", static_cast<int>(reading));
  testing::Test::RecordProperty("rendering_mb", static_cast<int>(rendering));
  EXPECT_LT(reading, limit_mb);
  EXPECT_LT(rendering, limit_mb);
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool sanitized = true;
#else
constexpr bool sanitized = false;
#endif

TEST(ModelMemory, OfManyTrianglesStaysInItsBar) {
  if (sanitized) GTEST_SKIP() << "the sanitizer takes memory of its own";
  const std::filesystem::path folder = made::make_temporary_directory();
  const int side = PLATELIGHT_FULL_TESTS ? 1582 : 400;  // 5,005,448 or 320,000 triangles
  write_glb(folder / "small.glb", made_sheet(8));
  write_glb(folder / "sheet.glb", made_sheet(side));
  write_ply(folder / "sheet.ply", made_sheet(side));
  expect_within_bar(folder / "sheet.glb", folder / "small.glb");
  expect_within_bar(folder / "sheet.ply", folder / "small.glb");
  std::filesystem::remove_all(folder);
}

TEST(ModelMemory, OfTheHeadlightIsBelow400MegabytesInAll) {
  if (sanitized) GTEST_SKIP() << "the sanitizer takes memory of its own";
  PaperScene paper = made_paper_scene("headlight");
  malloc_trim(0);
  take_peak_mb();
  const LightTable lights = make_light_table(paper.environment, {64, LightMethod::split});
  const Scene scene(std::move(paper.scene));
  const double focal_px = 0.5 * width / std::tan(0.5 * paper.horizontal_view_rad);
  EXPECT_TRUE(shows(scene, paper.environment, lights, paper.cam_from_set, focal_px));
  const double peak = take_peak_mb();
  RecordProperty("peak_mb", static_cast<int>(peak));
  EXPECT_LT(peak, 400);

  // And with all of it kept from frame to frame, at a few rays along edges.
  const Effort edges{.aa_samples = 4, .aa_tolerance = 0, .glint_contrast = 0.4F, .accuracy = 0.95F};
  KeptTransport kept;
  EXPECT_TRUE(shows(scene, paper.environment, lights, paper.cam_from_set, focal_px, edges, &kept));
  const double kept_peak = take_peak_mb();
  EXPECT_FALSE(kept.is_full());
  RecordProperty("kept_mb", static_cast<int>(kept.bytes() >> 20));
  RecordProperty("peak_with_kept_mb", static_cast<int>(kept_peak));
  EXPECT_LT(kept_peak, 400);
}

}  // namespace
}  // namespace render::model_memory_test
