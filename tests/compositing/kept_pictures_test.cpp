// Cells that are found without the live pictures before them: what these hide, show and shade is
// looked at in each frame, and nothing else is found anew.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "compositing/billboard.h"
#include "compositing/keyed_picture.h"
#include "found_with.h"
#include "furnished_scene.h"
#include "made_shot.h"
#include "render/kept_transport.h"
#include "render/kernel.h"
#include "render/picture_stalls.h"
#include "render/trace.h"

namespace compositing::kept_pictures_test {
namespace {

using render::FrameResult;
using render::Vec3f;

constexpr int width = 160, height = 120, cells = 10 * 8;

// A soft-edged figure of two colours, which leans.
std::shared_ptr<const KeyedPicture> figure(float lean, float red = 0.7F) {
  constexpr int w = 96, h = 192;
  capture::Image image = capture::make_image(h, w, 4);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const float py = (static_cast<float>(y) + 0.5F) / h;
      const float px = (static_cast<float>(x) + 0.5F) / w - 0.5F - lean * (1 - py);
      const float head = 0.13F - std::hypot(px, (py - 0.16F) * 2);
      const float body = 0.22F - std::abs(px) - 0.1F * std::abs(py - 0.6F);
      const float within = std::max(head, py > 0.25F && py < 0.98F ? body : -1.0F);
      const float alpha = std::clamp(0.5F + within * 30, 0.0F, 1.0F);
      const std::array colour =
          py < 0.27F ? std::array{red, 0.5F, 0.4F} : std::array{0.1F, 0.2F, red};
      for (int c = 0; c < 3; ++c) image.at(y, x, c) = alpha * colour[static_cast<std::size_t>(c)];
      image.at(y, x, 3) = alpha;
    }
  }
  return std::make_shared<KeyedPicture>(make_keyed_texture(image));
}

struct Places {
  Vec3f person{0, 0, 0}, box{-0.8F, -0.5F, 0};
  bool with_lit = false;     // and somebody in the set's light beside
  bool with_second = false;  // and somebody before the person, in part
};

// A person between a box and a wall, on a floor that catches shadows, with a mirror behind and a
// glass ball in front. What the camera sees of the person, the box hides in part.
render::SceneDescription scene_of(const Places& at, const char* shader = "billboard") {
  register_shaders();
  register_found_with();
  render::SceneDescription scene;
  scene.background = "plate";
  scene.materials = {make_billboard_material("person", {})};
  scene.materials[0].shader = shader;
  scene.meshes = {std::make_shared<render::Mesh>(make_billboard_mesh(0))};
  render::Instance& person = scene.instances.emplace_back();
  person.name = "person";
  person.set_from_object = {1, 0, 0, at.person.x, 0, 1, 0, at.person.y, 0, 0, 2, at.person.z};
  person.moves = true;
  furnish(scene, {0.9F, 1.4F}, {0.55F, -0.6F, 0.6F});
  const auto add = [&](render::Material material, const std::array<float, 12>& set_from_object) {
    const auto number = static_cast<std::uint32_t>(scene.materials.size());
    render::Instance& somebody = scene.instances.emplace_back();
    somebody.name = material.name;
    somebody.mesh = static_cast<std::uint32_t>(scene.meshes.size());
    somebody.moves = true;
    somebody.set_from_object = set_from_object;
    scene.materials.push_back(std::move(material));
    scene.meshes.push_back(std::make_shared<render::Mesh>(make_billboard_mesh(number)));
  };
  if (at.with_lit) {
    add(make_billboard_material("lit", {.picture = 1, .lit = true}),
        {0.6F, 0, 0, 0.7F, 0, 1, 0, -0.3F, 0, 0, 1.2F, 0});
  }
  if (at.with_second) {
    render::Material second =
        make_billboard_material("second", {.picture = 1, .gain = {1, 0.5F, 1}});
    second.shader = shader;
    add(std::move(second), {0.8F, 0.1F, 0, 0.25F, -0.2F, 1, 0, -0.5F, 0, 0, 1.7F, 0});
  }
  scene.materials.push_back(render::make_standard_material("box", {}));
  scene.meshes.push_back(
      made_ball({0, 0, 0.3F}, 0.3F, static_cast<std::uint32_t>(scene.materials.size() - 1)));
  render::Instance& box = scene.instances.emplace_back();
  box.name = "box";
  box.mesh = static_cast<std::uint32_t>(scene.meshes.size() - 1);
  box.moves = true;
  box.set_from_object = {1, 0, 0, at.box.x, 0, 1, 0, at.box.y, 0, 0, 1, at.box.z};
  return scene;
}

// The same set with its things elsewhere: no part of it is made anew.
render::SceneDescription moved_to(render::SceneDescription scene, const Places& at) {
  auto& person = scene.instances.front().set_from_object;
  auto& box = scene.instances.back().set_from_object;
  person[3] = at.person.x, person[7] = at.person.y, person[11] = at.person.z;
  box[3] = at.box.x, box[7] = at.box.y, box[11] = at.box.z;
  return scene;
}

// And with another picture.
void show(MadeShot& shot, const Places& at, const std::shared_ptr<const KeyedPicture>& picture) {
  shot.scene = std::make_unique<render::Scene>(moved_to(shot.scene->description(), at), *shot.scene,
                                               render::Scene::Pictures{picture, picture});
}

MadeShot shot_of(const Places& at,
                 const std::shared_ptr<const KeyedPicture>& picture,
                 const char* shader = "billboard") {
  MadeShot shot;
  shot.scene = std::make_unique<render::Scene>(scene_of(at, shader),
                                               render::Scene::Pictures{picture, picture});
  const double f = width * 1.1;
  shot.directions = calibrate::make_direction_table(
      {"pinhole", width, height, {f, f, (width - 1) / 2.0, (height - 1) / 2.0}});
  shot.environment = made_sky(32, 0.1F, 1);
  shot.plate = made_plate(height, width);
  shot.job.cam_from_set = calibrate::look_at({0.3, -4, 1.6}, {0, 0, 0.9}, 0);
  shot.job.lights = even_lights(64);
  return shot;
}

FrameResult rendered(const MadeShot& shot,
                     render::KeptTransport* kept,
                     const render::PictureStalls* stalls = nullptr) {
  render::FrameInputs inputs = shot.inputs();
  inputs.kept = kept;
  inputs.stalls = stalls;
  FrameResult result;
  render::render_frame(inputs, shot.job, shot.plate, result);
  return result;
}

std::uint64_t rays_of(const FrameResult& result) {
  const render::RenderStatistics& s = result.statistics;
  return s.primary_rays + s.secondary_rays + s.shadow_rays;
}

// A few lamps about the person, one of them a piece of a wall.
void add_lamps(render::LightTable& lights) {
  for (const Vec3f at : {Vec3f{-1, -1.5F, 1.2F}, {1.2F, -1, 0.8F}, {0.2F, 0.8F, 1.8F}}) {
    render::LocalLight& lamp = lights.lamps.emplace_back();
    lamp.position = at;
    lamp.normal = normalize(Vec3f{0, 0, 0.5F} - at);
    lamp.intensity = {1.5F, 1.2F, 0.9F};
  }
  lights.lamps.back().area_m2 = 0.05F;
}

// Before, behind, in mirrors, through glass, in shadow and at things' edges.
void expect_as_if_found_with(bool lamps, const Places& at = {}) {
  MadeShot shot = shot_of(at, figure(0.1F));
  MadeShot with = shot_of(at, figure(0.1F), "found_with");
  if (lamps) add_lamps(shot.job.lights), add_lamps(with.job.lights);
  ASSERT_FALSE(render::make_frame_context(shot.inputs(), shot.job).stalls.empty());
  ASSERT_TRUE(render::make_frame_context(with.inputs(), with.job).stalls.empty());
  const capture::Image apart = capture::to_float(rendered(shot, nullptr).rgba);
  const capture::Image truth = capture::to_float(rendered(with, nullptr).rgba);
  double squares = 0, sum = 0;
  int far_off = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      float most = 0;
      for (int c = 0; c < 3; ++c) {
        const float off = apart.at(y, x, c) - truth.at(y, x, c);
        squares += double{off} * off;
        sum += double{truth.at(y, x, c)} * truth.at(y, x, c);
        most = std::max(most, std::abs(off));
      }
      far_off += most > 0.1F;
    }
  }
  EXPECT_LT(std::sqrt(squares / sum), 0.012);
  EXPECT_LT(far_off, width * height / 500);
  ::testing::Test::RecordProperty("relative_rms", std::to_string(std::sqrt(squares / sum)));
}

// In blocks, too, persons are each pixel's own; what blocks share is as coarse as without them.
TEST(KeptPictures, AreEachPixelsOwnInBlocks) {
  MadeShot shot = shot_of({}, figure(0.1F)), with = shot_of({}, figure(0.1F), "found_with");
  for (MadeShot* of : {&shot, &with}) of->job.stages.assign(cells, 1);
  const capture::Image apart = capture::to_float(rendered(shot, nullptr).rgba);
  const capture::Image truth = capture::to_float(rendered(with, nullptr).rgba);
  int far_off = 0;
  for (std::size_t i = 0; i < truth.pixels.size(); ++i) {
    far_off += std::abs(apart.pixels[i] - truth.pixels[i]) > 0.05F;
  }
  EXPECT_LT(far_off, width * height / 40);
  render::KeptTransport kept;
  const std::uint64_t first = rays_of(rendered(shot, &kept));
  show(shot, {}, figure(0));
  EXPECT_LT(rays_of(rendered(shot, &kept)), first / 3);
}

TEST(KeptPictures, LookAsIfFoundWithThem) { expect_as_if_found_with(false); }
TEST(KeptPictures, DimLampsAsIfFoundWithThem) { expect_as_if_found_with(true); }
TEST(KeptPictures, LookAsIfFoundWithThemOneBeforeTheOther) {
  expect_as_if_found_with(false, {.with_second = true});
}

// What looking takes is told, of cells where there is anything to look at.
TEST(KeptPictures, TellWhatTheyTake) {
  MadeShot shot = shot_of({}, figure(0));
  render::KeptTransport kept;
  rendered(shot, &kept);
  const std::vector<float> looks = kept.looks_ms();
  EXPECT_TRUE(std::ranges::all_of(looks, [](float ms) { return ms >= 0 && ms < 1e3F; }));
  EXPECT_GT(std::ranges::max(looks), 0);
  render::SceneDescription set = scene_of({});
  set.instances.erase(set.instances.begin());
  shot.scene = std::make_unique<render::Scene>(std::move(set));
  rendered(shot, &kept);
  EXPECT_EQ(kept.looks_ms(), std::vector<float>(looks.size(), 0.0F));
}

TEST(KeptPictures, TakeNoRaysOfTheSet) {
  MadeShot shot = shot_of({}, figure(0));
  render::KeptTransport kept;
  const std::uint64_t first = rays_of(rendered(shot, &kept));
  for (const float lean : {0.05F, 0.1F}) {
    show(shot, {}, figure(lean));
    EXPECT_LT(rays_of(rendered(shot, &kept)), first / 5);
    EXPECT_TRUE(std::ranges::all_of(kept.stages(),
                                    [](int stage) { return stage == render::finished_stage; }));
  }
}

// Pictures, their places within their stalls and beyond, other things, plate and stages change.
void expect_same_cold_and_warm(bool with_lit) {
  Places at;
  at.with_lit = with_lit;
  MadeShot shot = shot_of(at, figure(0));
  shot.job.effort.aa_samples = 4;
  shot.job.effort.aa_tolerance = 0.2F;
  shot.job.stages.assign(cells, render::finished_stage);
  add_lamps(shot.job.lights);
  render::KeptTransport kept;
  render::StallFollower follower;
  std::mt19937 random(5);
  const auto pick = [&random](int most) {
    return std::uniform_int_distribution<int>(0, most)(random);
  };
  auto picture = figure(0);
  int kept_frames = 0;
  for (int frame = 0; frame < 20; ++frame) {
    if (pick(2) > 0)
      picture = figure(0.02F * static_cast<float>(pick(9)), 0.1F * static_cast<float>(pick(9)));
    if (pick(2) == 0) at.person.x = 0.05F * static_cast<float>(pick(3));
    if (pick(4) == 0) at.person.y = 0.25F * static_cast<float>(pick(3));
    if (pick(3) == 0) at.box.x = -1.2F + 0.4F * static_cast<float>(pick(3));
    show(shot, at, picture);
    for (capture::Half& value : shot.plate.pixels) value ^= static_cast<capture::Half>(pick(1));
    if (pick(2) == 0) {
      for (std::uint8_t& stage : shot.job.stages) {
        if (pick(3) == 0) stage = static_cast<std::uint8_t>(pick(6));
      }
    }
    const render::PictureStalls stalls = follower.follow(shot.scene->places());
    const render::PictureStalls* given = pick(3) > 0 ? &stalls : nullptr;
    const FrameResult warm = rendered(shot, &kept, given), cold = rendered(shot, nullptr, given);
    EXPECT_EQ(warm.rgba.pixels, cold.rgba.pixels) << frame;
    EXPECT_EQ(warm.matte.pixels, cold.matte.pixels) << frame;
    kept_frames += 2 * rays_of(warm) < rays_of(cold);
  }
  if (!with_lit) {
    EXPECT_GT(kept_frames, 2);
  }
}

TEST(KeptPictures, AreTheSameColdAndWarm) { expect_same_cold_and_warm(false); }
TEST(KeptPictures, AreTheSameColdAndWarmBesideWhoIsLit) { expect_same_cold_and_warm(true); }

// Nothing is left of who has left the set.
TEST(KeptPictures, LeaveNothingBehind) {
  const auto nobody =
      std::make_shared<KeyedPicture>(make_keyed_texture(capture::make_image(16, 16, 4)));
  MadeShot shot = shot_of({}, figure(0));
  render::KeptTransport kept;
  rendered(shot, &kept);
  show(shot, {}, nobody);
  const FrameResult empty = rendered(shot, &kept);
  EXPECT_EQ(std::ranges::max(kept.looks_ms()), 0) << "nobody is looked for";
  render::SceneDescription set = scene_of({});
  set.instances.erase(set.instances.begin());
  MadeShot without = shot_of({}, figure(0));
  without.scene = std::make_unique<render::Scene>(std::move(set));
  const capture::Image a = capture::to_float(empty.rgba),
                       b = capture::to_float(rendered(without, nullptr).rgba);
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    ASSERT_NEAR(a.pixels[i], b.pixels[i], 2e-3F * std::max(b.pixels[i], 1.0F)) << i;
  }
}

// A billboard that leans, alone, of whole pictures or of a camera's.
render::Scene leaning_billboard(bool filmed, float translucency) {
  const BillboardCamera camera{{"pinhole", 96, 192, {180, 180, 47.5, 95.5}},
                               calibrate::look_at({0.2, -3, 1.1}, {0, 0, 1}, 0)};
  render::SceneDescription scene = scene_of({});
  scene.instances.resize(1);
  const BillboardSettings settings{.gain = {0.9F, 1.1F, 1}, .translucency = translucency};
  scene.materials[0] = filmed ? make_billboard_material("person", settings, camera)
                              : make_billboard_material("person", settings);
  scene.instances[0].set_from_object = {0.9F, -0.3F, 0.1F, 0.2F, 0.4F, 0.8F,
                                        0,    0.1F,  0,    0.1F, 1.9F, 0.05F};
  return render::Scene(std::move(scene), {figure(0.1F)});
}

// From all about it, towards it; every other one may end before it.
struct RaysAbout {
  static constexpr std::size_t count = 2003;
  std::array<std::vector<float>, 7> columns;

  RaysAbout() {
    std::mt19937 random(9);
    std::uniform_real_distribution<float> at(-1.5F, 1.5F);
    for (std::vector<float>& column : columns) column.assign(count, 0);
    auto& [ox, oy, oz, dx, dy, dz, far] = columns;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3f to = normalize(Vec3f{0.3F * at(random), 0.3F * at(random), 1 + at(random)} -
                                 Vec3f{at(random), at(random), 0});
      ox[i] = at(random), oy[i] = at(random), oz[i] = at(random);
      dx[i] = to.x, dy[i] = to.y, dz[i] = to.z;
      far[i] = i % 2 == 0 ? render::ray_far : 1.5F;
    }
  }
  Vec3f origin(std::size_t i) const { return {columns[0][i], columns[1][i], columns[2][i]}; }
  Vec3f direction(std::size_t i) const { return {columns[3][i], columns[4][i], columns[5][i]}; }
  float far_m(std::size_t i) const { return columns[6][i]; }
  render::SightRays sights() const {
    const auto& [ox, oy, oz, dx, dy, dz, far] = columns;
    return {count, ox.data(), oy.data(), oz.data(), dx.data(), dy.data(), dz.data(), far.data()};
  }
};

// Rays to light are dimmed without a tree as by the tree's filter.
TEST(KeptPictures, DimLightAsTheirShaderDoes) {
  const RaysAbout rays;
  for (const bool filmed : {false, true}) {
    for (const float translucency : {0.0F, 0.6F}) {
      const render::Scene scene = leaning_billboard(filmed, translucency);
      ASSERT_EQ(scene.prepared().size(), 1U);
      const render::StandingPicture* picture = scene.prepared()[0].prepared->picture();
      ASSERT_NE(picture, nullptr);
      std::vector<float> none(rays.count), red(rays.count, 1), green(red), blue(red);
      picture->dim(
          {rays.sights(), none.data(), none.data(), red.data(), green.data(), blue.data()});
      int dimmed = 0, unlike = 0;
      for (std::size_t i = 0; i < rays.count; ++i) {
        const Vec3f share =
            transmittance(scene, rays.origin(i), rays.direction(i), 0, rays.far_m(i), ~0U);
        dimmed += share.x < 0.5F;
        unlike += std::abs(share.x - red[i]) > 0.02F || std::abs(share.z - blue[i]) > 0.02F;
      }
      EXPECT_GT(dimmed, 20);
      EXPECT_LT(unlike, 3) << filmed << translucency;  // at its very rim
    }
  }
}

// And rays that look at them see what rays through the tree do.
TEST(KeptPictures, ShowWhatTheirShaderDoes) {
  const RaysAbout rays;
  constexpr float footprint_m = 0.02F;
  for (const bool filmed : {false, true}) {
    const render::Scene scene = leaning_billboard(filmed, 0);
    const render::SceneDescription& set = scene.description();
    const render::StandingPicture* picture = scene.prepared()[0].prepared->picture();
    ASSERT_NE(picture, nullptr);
    std::vector<render::Sight> sights;
    picture->meet(rays.sights(), sights);
    ASSERT_TRUE(std::ranges::is_sorted(sights, {}, &render::Sight::ray));
    for (render::Sight& sight : sights) sight.footprint_m = footprint_m;
    picture->see(sights);
    auto sight = sights.begin();
    int seen = 0, unlike = 0;
    for (std::size_t i = 0; i < rays.count; ++i) {
      render::Layer layer{{}, {1, 1, 1}};
      float distance_m = 0;
      const auto met =
          closest_hit(scene, rays.origin(i), rays.direction(i), 0, ~0U, render::RayKind::camera);
      if (met && met->distance < rays.far_m(i)) {
        render::HitPoint hit;
        scene.read_hit(met->geom_id, met->prim_id, met->inst_id, met->u, met->v, rays.direction(i),
                       hit);
        layer = *scene.shader_of(hit.material)
                     .layer({&set, &scene, scene.pictures(), scene.prepared()},
                            set.materials[hit.material], hit, rays.direction(i),
                            render::RayKind::camera, footprint_m);
        distance_m = met->distance;
      }
      render::Sight own;
      if (sight != sights.end() && sight->ray == i) own = *sight++;
      const bool open = layer.passed == Vec3f{1, 1, 1};
      seen += !open;
      unlike += length(own.radiance - layer.radiance) > 0.02F ||
                length(own.passed - layer.passed) > 0.02F ||
                (!open && std::abs(own.distance_m - distance_m) > 1e-4F);
      if (own.distance_m > 0) {
        EXPECT_LT(dot(own.normal, rays.direction(i)), 0);
        EXPECT_LT(length(rays.origin(i) + rays.direction(i) * own.distance_m - own.position),
                  1e-4F);
      }
    }
    EXPECT_EQ(sight, sights.end());
    EXPECT_GT(seen, 20);
    EXPECT_LT(unlike, 3) << filmed;  // at its very rim
  }
}

render::Scene::Places places_at(float x, float wide = 1) {
  render::Scene::Places places;
  places.bounds = {{{x, 0, 0}, {x + wide, 0.1F, 2}}};
  places.pictures = {{figure(0)}};
  places.apart = {1};
  return places;
}

// Boxes may be flat.
TEST(PictureStalls, TellWhatHasChangedBetweenThem) {
  using Boxes = std::vector<render::Scene::Bounds>;
  const auto changed = [](const render::Scene::Bounds& a, const render::Scene::Bounds& b) {
    return render::PictureStalls::changed(render::PictureStalls(Boxes{a}),
                                          render::PictureStalls(Boxes{b}));
  };
  const auto flat_at = [](float y) { return render::Scene::Bounds{{0, y, 0}, {1, y, 2}}; };
  EXPECT_TRUE(changed(flat_at(2), flat_at(2)).empty());
  for (const float y : {1.0F, 2.5F}) {
    const Boxes both = changed(flat_at(2), flat_at(y));
    for (const float at : {2.0F, y}) {
      EXPECT_TRUE(std::ranges::any_of(both,
                                      [&](const render::Scene::Bounds& box) {
                                        return box.lower.y <= at && box.upper.y >= at &&
                                               box.lower.x == 0 && box.upper.x == 1;
                                      }))
          << y << at;
    }
  }
  // Of one that is wider on one side alone, no more than that side.
  const Boxes rest = changed({{0, 0, 0}, {1, 1, 2}}, {{0, 0, 0}, {1.5F, 1, 2}});
  ASSERT_EQ(rest.size(), 1U);
  EXPECT_EQ(rest[0].lower, (Vec3f{1, 0, 0}));
  EXPECT_EQ(rest[0].upper, (Vec3f{1.5F, 1, 2}));
}

TEST(StallFollower, KeepsAStallUntilItIsLeft) {
  render::StallFollower follower;
  const render::PictureStalls first = follower.follow(places_at(0));
  EXPECT_TRUE(first.hold(places_at(0)));
  const auto same = [&](const render::PictureStalls& stalls) {
    return render::PictureStalls::changed(first, stalls).empty();
  };
  EXPECT_TRUE(same(follower.follow(places_at(0.2F))));
  EXPECT_TRUE(same(follower.follow(places_at(-0.2F))));
  const render::PictureStalls second = follower.follow(places_at(3));
  EXPECT_FALSE(same(second));
  EXPECT_TRUE(second.hold(places_at(3)));
  EXPECT_FALSE(second.hold(places_at(0)));
}

TEST(StallFollower, GivesUpWhatIsFarTooLargeForLong) {
  render::StallFollower follower;
  const render::PictureStalls wide = follower.follow(places_at(0, 8));
  int frames = 0;
  while (frames < 2 * render::StallFollower::patience &&
         render::PictureStalls::changed(wide, follower.follow(places_at(1, 1))).empty()) {
    ++frames;
  }
  EXPECT_EQ(frames, render::StallFollower::patience);
}

TEST(StallFollower, HasNoneOfNobody) {
  render::StallFollower follower;
  EXPECT_FALSE(follower.follow(places_at(0)).empty());
  EXPECT_TRUE(follower.follow({}).empty());
}

}  // namespace
}  // namespace compositing::kept_pictures_test
