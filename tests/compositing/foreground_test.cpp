// Persons before pictures that are still coarse: each pixel shows its own of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "compositing/billboard.h"
#include "found_with.h"
#include "made_shot.h"
#include "render/kept_transport.h"
#include "render/kernel.h"
#include "render/live_picture.h"
#include "render/refinement.h"

namespace compositing::foreground_test {
namespace {

using render::FrameResult;
using render::Vec3f;

constexpr int width = 96, height = 64, cells = 6 * 4;

// Fine checks of one colour, opaque, thin and clear in turn; nothing in the outer eighth.
class Checks final : public render::LivePicture {
 public:
  explicit Checks(std::array<float, 3> colour) : colour_(colour) {}
  std::array<float, 4> look_up(float u, float v, float) const override {
    if (!(std::min({u, v, 1 - u, 1 - v}) > 0.125F)) return {};
    const int check = static_cast<int>(u * 40) + static_cast<int>(v * 40) * 2;
    const float alpha = std::array{1.0F, 0.5F, 0.0F}[static_cast<std::size_t>(check % 3)];
    return {alpha * colour_[0], alpha * colour_[1], alpha * colour_[2], alpha};
  }

 private:
  std::array<float, 3> colour_;
};

// Whole, everywhere.
class Whole final : public render::LivePicture {
 public:
  std::array<float, 4> look_up(float, float, float) const override { return {0.3F, 0.6F, 0.9F, 1}; }
};

struct Person {
  Vec3f at;  // the middle of its feet
  std::shared_ptr<const render::LivePicture> picture;
  bool lit = false;
};

// The made shot's floor and ball of paint with persons who face its camera, 1 m high and wide.
render::SceneDescription scene_with(const std::vector<Person>& persons) {
  render::SceneDescription scene = shot_scene();
  register_found_with();
  scene.instances.pop_back();  // through glass, persons are as coarse as the rest
  constexpr float r = 0.70710678F;
  for (const Person& person : persons) {
    const auto number = static_cast<std::uint32_t>(scene.materials.size());
    const auto picture = static_cast<std::uint32_t>(&person - persons.data());
    render::Material& material = scene.materials.emplace_back(
        make_billboard_material("person", {.picture = picture, .lit = person.lit}));
    // Others are not found with cells at all (kept_pictures_test.cpp).
    material.shader = "found_with";
    scene.meshes.push_back(std::make_shared<render::Mesh>(make_billboard_mesh(number)));
    render::Instance& shown = scene.instances.emplace_back();
    shown.name = "person";
    shown.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
    shown.moves = true;
    shown.set_from_object = {r, -r, 0, person.at.x, r, r, 0, person.at.y, 0, 0, 1, person.at.z};
  }
  return scene;
}

MadeShot shot_of(const std::vector<Person>& persons) {
  MadeShot shot = made_shot(width, height, shot_scene());
  render::Scene::Pictures pictures;
  for (const Person& person : persons) pictures.push_back(person.picture);
  shot.scene = std::make_unique<render::Scene>(scene_with(persons), std::move(pictures));
  return shot;
}

FrameResult render_at(const MadeShot& shot,
                      int stage,
                      render::KeptTransport* kept = nullptr,
                      bool counts = false) {
  render::FrameJob job = shot.job;
  job.stages.assign(cells, static_cast<std::uint8_t>(stage));
  render::FrameInputs inputs = shot.inputs();
  inputs.kept = kept;
  inputs.count_rays = counts;
  FrameResult result;
  render_frame(inputs, job, shot.plate, result);
  return result;
}

const Person in_front{{1.2F, -1.1F, 0}, std::make_shared<Checks>(std::array{0.9F, 0.1F, 0.2F})};
const Person behind_it{{0.7F, -0.6F, 0.1F}, std::make_shared<Checks>(std::array{0.1F, 0.8F, 0.2F})};
const Person behind_ball{{-0.4F, 0.9F, 0}, std::make_shared<Whole>()};

// Two persons, one behind the other, partly behind a ball: in blocks, a pixel shows of them what it
// shows with a ray of its own, before what its block's ray sees without them.
TEST(Foreground, IsEachPixelsOwnBeforeWhatBlocksShare) {
  const auto grey = [](float value) {
    const auto picture = std::make_shared<Checks>(std::array{value, value, value});
    MadeShot shot = shot_of({{in_front.at, picture}, {behind_it.at, picture}});
    shot.job.effort.aa_samples = 1;
    shot.job.effort.soft_lights = false;
    return shot;
  };
  const MadeShot dark = grey(0), bright = grey(4);
  const auto at = [](const MadeShot& of, int stage) {
    return capture::to_float(render_at(of, stage).rgba);
  };
  // One ray a pixel too, but followed on behind what is thin.
  const capture::Image fine_dark = at(dark, render::finished_stage),
                       fine_bright = at(bright, render::finished_stage);
  for (int stage = 0; stage < render::one_ray_stage; ++stage) {
    const capture::Image coarse_dark = at(dark, stage), coarse_bright = at(bright, stage);
    const int size = render::block_of_stage(stage);
    int seen = 0, differ = 0, uncovered = 0, compared = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        // Of themselves, and a little of them mirrored.
        const float fine_own = fine_bright.at(y, x, 0) - fine_dark.at(y, x, 0);
        const float own = coarse_bright.at(y, x, 0) - coarse_dark.at(y, x, 0);
        seen += fine_own > 1.9F;
        differ += std::abs(own - fine_own) > 0.3F;
        // The block's ray goes between this pixel and those beside and below it.
        const bool has_ray = x % size == (size - 1) / 2 && y % size == (size - 1) / 2;
        if (!has_ray || x + 1 == width || y + 1 == height) continue;
        const float cover = fine_dark.at(y, x, 3);
        const bool alike = cover == fine_dark.at(y, x + 1, 3) &&
                           cover == fine_dark.at(y + 1, x, 3) &&
                           cover == fine_dark.at(y + 1, x + 1, 3);
        uncovered += alike && std::abs(coarse_dark.at(y, x, 3) - cover) > 0.002F;
        compared += alike;
      }
    }
    EXPECT_GT(seen, 500) << stage;
    EXPECT_LT(differ, seen / 100) << stage;
    EXPECT_EQ(uncovered, 0) << stage;
    EXPECT_GT(compared, width * height / (2 * size * size)) << stage;
  }
}

// What stands before a person hides it in each pixel.
TEST(Foreground, IsHiddenByWhatStandsBeforeIt) {
  const MadeShot shot = shot_of({behind_ball});
  const FrameResult fine = render_at(shot, render::one_ray_stage);
  const FrameResult coarse = render_at(shot, 1);
  const auto is_person = [](const FrameResult& frame, int y, int x) {
    const std::size_t i = frame.rgba.index(y, x, 0);
    const auto value = [&](std::size_t c) {
      return capture::float_from_half(frame.rgba.pixels[i + c]);
    };
    return std::abs(value(0) - 0.3F) + std::abs(value(1) - 0.6F) + std::abs(value(2) - 0.9F) <
           2e-3F;
  };
  int persons = 0, hidden = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      EXPECT_EQ(is_person(coarse, y, x), is_person(fine, y, x)) << x << ' ' << y;
      persons += is_person(fine, y, x);
      hidden += !is_person(fine, y, x);
    }
  }
  EXPECT_GT(persons, 100);
  EXPECT_GT(hidden, 100);
}

// Blocks of which a person hides all take no rays for what is behind; nothing is lit there.
TEST(Foreground, SparesWhatItHides) {
  const MadeShot shot = shot_of({{{2.2F, -2.3F, 0.5F}, std::make_shared<Whole>()}});
  const FrameResult result = render_at(shot, 1, nullptr, true);
  int hidden = 0;
  for (const render::RayCount& pixel : result.rays.pixels) hidden += pixel.shadow_rays == 0;
  EXPECT_GT(hidden, width * height / 4);
  const FrameResult without = render_at(made_shot(width, height, shot_scene()), 1);
  EXPECT_LT(result.statistics.shadow_rays, without.statistics.shadow_rays * 3 / 4);
}

// The set's light on a person needs what lights a surface: it is as coarse as that.
TEST(Foreground, IsNotOfPersonsInTheSetsLight) {
  Person lit = in_front;
  lit.lit = true;
  const MadeShot shot = shot_of({lit});
  const FrameResult fine = render_at(shot, render::one_ray_stage);
  const FrameResult coarse = render_at(shot, 1);
  const int size = render::block_of_stage(1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto middle = [&](int i) { return i - i % size + (size - 1) / 2; };
      const std::size_t own = coarse.rgba.index(y, x, 3);
      ASSERT_EQ(coarse.rgba.pixels[own],
                coarse.rgba.pixels[coarse.rgba.index(middle(y), middle(x), 3)]);
    }
  }
  EXPECT_NE(coarse.rgba.pixels, fine.rgba.pixels);
}

// Pictures, places, plate and stages change; what is kept does not tell.
TEST(Foreground, IsTheSameColdAndWarm) {
  std::vector<Person> persons{in_front, behind_it};
  MadeShot shot = shot_of(persons);
  render::KeptTransport kept;
  std::mt19937 random(3);
  const auto pick = [&random](int most) {
    return std::uniform_int_distribution<int>(0, most)(random);
  };
  render::Scene::Pictures pictures{persons[0].picture, persons[1].picture};
  for (int frame = 0; frame < 10; ++frame) {
    if (pick(2) > 0) {
      const float red = 0.1F * static_cast<float>(pick(9));
      pictures[static_cast<std::size_t>(pick(1))] =
          std::make_shared<Checks>(std::array{red, 0.3F, 1 - red});
    }
    if (pick(3) == 0) persons[1].at.x = 0.5F + 0.1F * static_cast<float>(pick(6));
    shot.scene = std::make_unique<render::Scene>(scene_with(persons), *shot.scene, pictures);
    for (capture::Half& value : shot.plate.pixels) value ^= static_cast<capture::Half>(pick(1));
    shot.job.stages.resize(cells);
    for (std::uint8_t& stage : shot.job.stages) stage = static_cast<std::uint8_t>(pick(3));
    const auto render = [&](render::KeptTransport* memory) {
      render::FrameInputs inputs = shot.inputs();
      inputs.kept = memory;
      FrameResult result;
      render_frame(inputs, shot.job, shot.plate, result);
      return result;
    };
    const FrameResult warm = render(&kept), cold = render(nullptr);
    EXPECT_EQ(warm.rgba.pixels, cold.rgba.pixels) << frame;
    EXPECT_EQ(warm.matte.pixels, cold.matte.pixels) << frame;
  }
}

}  // namespace
}  // namespace compositing::foreground_test
