// Visual hulls: what rays of every kind see of a person that several cameras film.
#include "compositing/visual_hull.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>

#include "compositing/hull_march.h"
#include "compositing/keyed_picture.h"
#include "compositing/made_walker.h"
#include "furnished_scene.h"
#include "made_shot.h"
#include "render/kept_transport.h"
#include "render/reference.h"
#include "render/trace.h"

namespace compositing::visual_hull_test {
namespace {

using render::Vec3f;

constexpr int width = 160, height = 120;
constexpr Vec3f lower{-0.8F, -0.8F, 0.001F}, upper{0.8F, 0.8F, 1.85F};

calibrate::Lens lens() { return {"pinhole", width, height, {190, 190, 79.5, 59.5}}; }

// A camera that looks at the middle of the box, `degrees` round from one on -y.
BillboardCamera camera_at(double degrees, double distance_m = 3.6, double up_m = 1.3) {
  const double angle = degrees * std::numbers::pi / 180;
  return {lens(),
          calibrate::look_at({distance_m * std::sin(angle), -distance_m * std::cos(angle), up_m},
                             {0, 0, 0.9}, 0)};
}

std::shared_ptr<const KeyedPicture> picture_of(const capture::Image& rgba) {
  return std::make_shared<KeyedPicture>(make_keyed_texture(rgba), true);
}
std::shared_ptr<const KeyedPicture> even_picture(std::array<float, 4> rgba) {
  capture::Image image = capture::make_image(height, width, 4);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = rgba[i % 4];
  return picture_of(image);
}

// In the middle of the box, in the middle of a step.
MadeWalker walker() { return {.start = {0, 0.78, 0}}; }
capture::Image walker_from(const BillboardCamera& camera) {
  return photograph_of(camera.lens, camera.cam_from_set, walker(), 0.65);
}
// Bodies of one colour.
capture::Image bodies_from(const BillboardCamera& camera, const std::vector<Capsule>& shape) {
  const MadeView view{camera.lens, camera.cam_from_set};
  capture::Image matte = capture::make_image(height, width, 1);
  draw(matte, view, shape);
  capture::Image rgba = capture::make_image(height, width, 4);
  for (std::size_t i = 0; i < matte.pixels.size(); ++i) {
    for (std::size_t c = 0; c < 4; ++c) {
      rgba.pixels[4 * i + c] = matte.pixels[i] * (c == 3 ? 1 : 0.5F);
    }
  }
  return rgba;
}

struct Filmed {
  std::vector<HullView> views;
  render::Scene::Pictures pictures;
};
template <class F>
Filmed filmed(const std::vector<double>& degrees, F&& photograph) {
  Filmed all;
  for (const double at : degrees) {
    const BillboardCamera camera = camera_at(at);
    all.views.push_back({static_cast<std::uint32_t>(all.views.size()), camera});
    all.pictures.push_back(picture_of(photograph(camera)));
  }
  return all;
}

render::SceneDescription scene_with(const std::vector<HullView>& views,
                                    const HullSettings& settings = {}) {
  register_shaders();
  render::SceneDescription scene;
  scene.background = "plate";
  scene.materials = {make_hull_material("person", settings, views)};
  scene.meshes = {std::make_shared<render::Mesh>(make_hull_mesh(0))};
  render::Instance& person = scene.instances.emplace_back();
  person.name = "person";
  person.set_from_object = placed_box(lower, upper);
  person.moves = true;
  return scene;
}

MadeShot shot_of(render::SceneDescription scene,
                 render::Scene::Pictures pictures,
                 const BillboardCamera& camera) {
  MadeShot shot;
  shot.scene = std::make_unique<render::Scene>(std::move(scene), std::move(pictures));
  shot.directions = calibrate::make_direction_table(camera.lens);
  shot.environment = made_sky(32, 0.1F, 1);
  shot.plate = made_plate(height, width);
  shot.job.cam_from_set = camera.cam_from_set;
  shot.job.lights = even_lights(64);
  return shot;
}

capture::Image rendered(const MadeShot& shot, render::KeptTransport* kept = nullptr) {
  render::FrameResult result;
  render::FrameInputs inputs = shot.inputs();
  inputs.kept = kept;
  render::render_frame(inputs, shot.job, shot.plate, result);
  return capture::to_float(result.rgba);
}

capture::Image seen_from(const Filmed& person,
                         const BillboardCamera& camera,
                         const HullSettings& settings = {}) {
  return rendered(shot_of(scene_with(person.views, settings), person.pictures, camera));
}

// Of one ray a pixel.
MadeShot plain(MadeShot shot) {
  shot.job.effort.aa_samples = 1;
  return shot;
}
capture::Image plainly_seen(const Filmed& person, const BillboardCamera& camera) {
  return rendered(plain(shot_of(scene_with(person.views), person.pictures, camera)));
}

void expect_numbers(const capture::Image& image) {
  for (const float value : image.pixels) ASSERT_TRUE(std::isfinite(value) && value >= 0);
}

TEST(Hull, IsACamerasOwnPictureAsSeenFromThere) {
  const Filmed person = filmed({0, 60, 120}, walker_from);
  for (const HullView& view : person.views) {
    const capture::Image truth = walker_from(view.camera);
    const capture::Image seen = seen_from(person, view.camera);
    const capture::Image plate = capture::to_float(made_plate(height, width));
    double worst = 0, squares = 0, count = 0;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const float alpha = truth.at(y, x, 3);
        worst = std::max(worst, std::abs(double{seen.at(y, x, 3)} - alpha));
        if (!(alpha > 0)) continue;
        for (int c = 0; c < 3; ++c) {
          const double wanted = truth.at(y, x, c) + (1 - alpha) * plate.at(y, x, c);
          squares += (seen.at(y, x, c) - wanted) * (seen.at(y, x, c) - wanted), ++count;
        }
      }
    }
    EXPECT_LT(worst, 0.5);  // a silhouette that is off by half a pixel
    EXPECT_LT(std::sqrt(squares / count), 0.03);
  }
}

TEST(Hull, HoldsTheBodyAndShrinksWithEveryCamera) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> across(-0.4, 0.4), up(0.3, 1.5), wide(0.08, 0.25);
  for (int i = 0; i < 4; ++i) {
    const std::vector<Capsule> shape{{{across(random), across(random), up(random)},
                                      {across(random), across(random), up(random)},
                                      wide(random)},
                                     {{across(random), across(random), up(random)},
                                      {across(random), across(random), up(random)},
                                      wide(random)}};
    const auto photograph = [&](const BillboardCamera& c) { return bodies_from(c, shape); };
    const BillboardCamera viewer = camera_at(25 + 80 * i, 3, 1.6);
    const capture::Image truth = bodies_from(viewer, shape);
    capture::Image fewer;
    double area_before = 0, first_area = 0;
    for (const auto& degrees : {std::vector<double>{0, 70}, std::vector<double>{0, 70, 140},
                                std::vector<double>{0, 70, 140, 35, 105}}) {
      const capture::Image seen = seen_from(filmed(degrees, photograph), viewer);
      double area = 0;
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
          area += seen.at(y, x, 3);
          // Half of a pixel's edge is the filters'.
          ASSERT_GT(seen.at(y, x, 3), truth.at(y, x, 3) - 0.5) << x << " " << y;
          if (fewer.pixels.empty()) continue;
          ASSERT_LT(seen.at(y, x, 3), fewer.at(y, x, 3) + 0.2) << x << " " << y;
        }
      }
      if (fewer.pixels.empty()) first_area = area_before = area;
      EXPECT_LT(area, 1.01 * area_before);  // steps are finer where more cameras look
      area_before = area;
      fewer = seen;
    }
    EXPECT_LT(area_before, 0.97 * first_area);
  }
}

// What is passed at once by coarse levels is empty.
void expect_what_sampling_finds(const Filmed& person, float step_px, int most_missed) {
  const render::Material material =
      make_hull_material("person", {.step_px = step_px}, person.views);
  HullBlock block;
  std::memcpy(&block, material.parameters.data(), sizeof block);
  const auto places = std::span(material.parameters).subspan(sizeof block);
  // Rays begin and end beyond this box: it holds all that they may meet.
  const HullCells cells(block, places, placed_box({-2, -2, -1}, {2, 2, 3}), person.pictures);
  const HullMarch march(cells, places, person.pictures);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> one(-1, 1), high(0, 1.8F);
  int met = 0, missed = 0;
  for (int i = 0; i < 400; ++i) {
    const Vec3f through{0.4F * one(random), 0.5F * one(random), high(random)};
    const Vec3f direction = normalize(Vec3f{one(random), one(random), 0.4F * one(random)});
    const HullRay ray{through - direction * 1.5F, direction, 0.004F, 0.001F};
    const HullMarch::Crossing found = march.find(ray, 0, 3);
    float most = 0;
    for (int k = 0; k < 3000; ++k) {
      const float t = 0.001F * (static_cast<float>(k) + 0.5F);
      float least = 1;
      bool seen = false;
      for (std::size_t view = 0; view < 3; ++view) {
        const auto rgba = march.look(view, ray.origin + direction * t, 0.004F + 0.001F * t);
        if (!rgba) continue;
        least = std::min(least, (*rgba)[3]);
        seen = true;
      }
      if (seen) most = std::max(most, least);
    }
    met += most > 0.9F;
    ASSERT_LT(found.alpha, most + 0.15) << i;
    missed += found.alpha < most - 0.15F;  // thinner than a step
  }
  EXPECT_GT(met, 50);
  EXPECT_LE(missed, most_missed);
}
TEST(HullMarch, FindsWhatSamplingEverywhereFinds) {
  expect_what_sampling_finds(filmed({0, 60, 120}, walker_from), 0.25F, 0);
}
TEST(HullMarch, MissesOnlyGrazedEdgesAtItsOwnStep) {
  expect_what_sampling_finds(filmed({0, 60, 120}, walker_from), HullSettings{}.step_px, 12);
}

TEST(HullMarch, FindsWhatSamplingEverywhereFindsThroughBentLenses) {
  Filmed person;
  for (const double degrees : {0, 60, 120}) {
    BillboardCamera camera = camera_at(degrees);
    camera.lens = {"kannala_brandt", width, height, {150, 150, 79.5, 59.5, -0.1, 0.02}};
    person.views.push_back({static_cast<std::uint32_t>(person.views.size()), camera});
    person.pictures.push_back(picture_of(bodies_from(
        camera, {{{0, 0.1, 0.3}, {0, 0, 1.5}, 0.2}, {{-0.5, 0, 1.2}, {0.5, 0.1, 1.3}, 0.06}})));
  }
  expect_what_sampling_finds(person, 0.25F, 0);
}

// Rays down the box's axes, as of a sun overhead, meet no more cells than there are.
TEST(CellWalk, TakesNoMorePiecesAlongAnAxisThanThereAreCells) {
  const Filmed person = filmed({0, 60, 120}, walker_from);
  const render::Material material = make_hull_material("person", {}, person.views);
  HullBlock block;
  std::memcpy(&block, material.parameters.data(), sizeof block);
  const HullCells cells(block, std::span(material.parameters).subspan(sizeof block),
                        placed_box(lower, upper), person.pictures);
  for (const float width_m : {0.0F, 0.04F, 0.15F}) {
    for (const Vec3f direction : {Vec3f{1, 0, 0}, Vec3f{0, -1, 0}, Vec3f{0, 0, 1}, Vec3f{0, 0, -1},
                                  normalize(Vec3f{0, 0.6F, 0.8F})}) {
      const Vec3f middle{0.02F, 0.03F, 0.91F};
      const float half_m = 0.75F;
      CellWalk walk(cells, middle - direction * half_m, direction, 0, 2 * half_m, width_m);
      CellWalk::Piece piece;
      int pieces = 0;
      while (walk.next(piece)) ++pieces;
      EXPECT_LE(pieces, 64) << width_m << " along " << direction.x << ' ' << direction.y << ' '
                            << direction.z;
    }
  }
}

TEST(Hull, IsAsSoftAsItsPictures) {
  const auto soft = even_picture({0.1F, 0.2F, 0.3F, 0.4F});
  Filmed person = filmed({0, 60}, [&](const BillboardCamera& c) {
    return bodies_from(c, {{{0, 0, 0.8}, {0, 0, 1.0}, 0.4}});
  });
  person.pictures[0] = soft;
  const capture::Image seen = seen_from(person, camera_at(20));
  const capture::Image plate = capture::to_float(made_plate(height, width));
  const int x = width / 2, y = height / 2;
  EXPECT_NEAR(seen.at(y, x, 3), 0.4, 0.01);
  // Mixed of both by their alpha, and no brighter or darker than they are.
  for (int c = 0; c < 3; ++c) {
    const float own = (seen.at(y, x, c) - 0.6F * plate.at(y, x, c)) / 0.4F;
    const float one = 0.25F * static_cast<float>(c + 1), other = 0.5F;
    EXPECT_GT(own, std::min(one, other) - 0.02);
    EXPECT_LT(own, std::max(one, other) + 0.02);
  }
}

// On a floor that catches the shadow, with a mirror behind and a glass ball in front.
render::SceneDescription furnished(const std::vector<HullView>& views) {
  render::SceneDescription scene = scene_with(views);
  furnish(scene, {1.1F, 1.5F}, {0.45F, -1.3F, 0.6F});
  return scene;
}

TEST(Hull, CastsShadowsAndIsMirroredAndRefractedAsTheReferenceHasIt) {
  const Filmed person = filmed({0, 60, 120}, walker_from);
  MadeShot shot = shot_of(furnished(person.views), person.pictures, camera_at(25, 4));
  shot.job.effort.light_samples = 64;
  shot.job.effort.accuracy = 0.99F;
  shot.job.effort.aa_tolerance = 0.02F;
  const capture::Image seen = rendered(shot);
  const capture::Image plate = capture::to_float(shot.plate);
  render::ReferenceSettings settings;
  settings.samples = 64;
  const capture::Image truth = render_reference(shot.inputs(), shot.job, plate, settings);
  const capture::Image mask = render::affected_mask(truth, plate);
  EXPECT_LT(render::picture_error(seen, truth, mask).relative_rms, 0.03);
}

TEST(Hull, IsTheSameWithWhatIsKeptFromOtherPictures) {
  Filmed person = filmed({0, 60}, walker_from);
  const render::SceneDescription scene = furnished(person.views);
  const auto at_time = [&](std::size_t view, double time_s) {
    const BillboardCamera& camera = person.views[view].camera;
    return picture_of(photograph_of(camera.lens, camera.cam_from_set, walker(), time_s, 2));
  };
  render::KeptTransport kept;
  MadeShot shot = shot_of(scene, person.pictures, camera_at(25, 4));
  rendered(shot, &kept);
  for (const std::size_t changed : {1U, 0U, 1U}) {
    person.pictures[changed] = at_time(changed, 0.6 + 0.1 * static_cast<double>(changed));
    shot.scene = std::make_unique<render::Scene>(scene, *shot.scene, person.pictures);
    const capture::Image warm = rendered(shot, &kept);
    const capture::Image cold = rendered(shot);
    ASSERT_EQ(warm.pixels, cold.pixels) << changed;
  }
}

TEST(Hull, IsCarvedAgainOnlyWhereItsPicturesOrItsPlaceChange) {
  Filmed person = filmed({0, 60}, walker_from);
  render::SceneDescription description = scene_with(person.views);
  const render::Scene first(description, person.pictures);
  ASSERT_EQ(first.prepared().size(), 1);
  const auto cells = first.prepared()[0].prepared;
  ASSERT_NE(cells, nullptr);
  const render::Scene same(description, first, person.pictures);
  ASSERT_EQ(same.prepared().size(), 1);
  EXPECT_EQ(same.prepared()[0].prepared, cells);
  description.instances[0].set_from_object[3] += 0.1F;
  const render::Scene moved(description, same, person.pictures);
  ASSERT_EQ(moved.prepared().size(), 1);
  EXPECT_NE(moved.prepared()[0].prepared, cells);
  const auto there = moved.prepared()[0].prepared;
  person.pictures[1] = even_picture({});
  const render::Scene other(description, moved, person.pictures);
  ASSERT_EQ(other.prepared().size(), 1);
  EXPECT_NE(other.prepared()[0].prepared, there);
}

TEST(Hull, HidesWhatIsBehindItInItsBoxAndIsHiddenByWhatIsBefore) {
  const Filmed person = filmed({0, 60, 120}, [&](const BillboardCamera& c) {
    return bodies_from(c, {{{0, 0, 0.8}, {0, 0, 1.0}, 0.3}});
  });
  const BillboardCamera viewer = camera_at(0);
  const auto with_ball = [&](float y, float gain) {
    render::SceneDescription scene = scene_with(person.views, {.gain = {gain, gain, gain}});
    render::StandardParameters glow;
    std::fill_n(glow.base_color, 3, 0.0F);
    glow.emission[0] = 5;
    scene.materials.push_back(make_standard_material("lamp", glow));
    scene.meshes.push_back(made_ball({0, y, 0.9F}, 0.1F, 1));
    scene.instances.emplace_back().mesh = 1;
    const MadeShot shot = shot_of(scene, person.pictures, viewer);
    return rendered(shot).at(height / 2, width / 2, 0);
  };
  EXPECT_NEAR(with_ball(-0.6F, 1), 5, 0.1);
  EXPECT_NEAR(with_ball(0.6F, 1), 0.5, 0.05);
}

// Rays that are decided while they travel are in the box's frame.
TEST(Hull, CastsTheSameShadowFromATurnedBox) {
  const Filmed person = filmed({0, 60, 120}, walker_from);
  const render::Scene straight(scene_with(person.views), person.pictures);
  render::SceneDescription scene = scene_with(person.views);
  const float c = std::cos(0.7F), s = std::sin(0.7F);
  // About the set's vertical, with the same floor and ceiling.
  scene.instances[0].set_from_object = {3 * c,
                                        -2.6F * s,
                                        0,
                                        -1.5F * c + 1.3F * s,
                                        3 * s,
                                        2.6F * c,
                                        0,
                                        -1.5F * s - 1.3F * c,
                                        0,
                                        0,
                                        upper.z - lower.z,
                                        lower.z};
  const render::Scene turned(scene, person.pictures);
  std::mt19937 random(9);
  std::uniform_real_distribution<float> one(-1, 1), high(0.1F, 1.7F);
  int dark = 0, clear = 0, darker = 0;
  for (int i = 0; i < 600; ++i) {
    const Vec3f through{0.3F * one(random), 0.3F * one(random), high(random)};
    const Vec3f direction = normalize(Vec3f{one(random), one(random), 0.2F * one(random)});
    const auto passed = [&](const render::Scene& of) {
      return render::transmittance(of, through - direction * 4, direction, 0, 8,
                                   render::mask_virtual)
          .x;
    };
    const float a = passed(straight), b = passed(turned);
    dark += a < 0.1F;
    // The larger box's steps lie elsewhere, and it holds more of what only some cameras see.
    clear += a > 0.9F;
    darker += a > 0.9F && b < 0.5F;
    if (a > 0.9F) continue;
    ASSERT_NEAR(a, b, 0.35) << i;
  }
  EXPECT_GT(dark, 100);
  EXPECT_GT(clear, 100);
  EXPECT_LT(darker, 10);
}

TEST(Hull, ShowsThePlateBitForBitWhereACameraSeesNobody) {
  Filmed person = filmed({0, 60}, walker_from);
  person.pictures[1] = even_picture({});
  const capture::Image seen = seen_from(person, camera_at(30));
  const capture::Image plate = capture::to_float(made_plate(height, width));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) ASSERT_EQ(seen.at(y, x, c), plate.at(y, x, c));
    }
  }
}

TEST(Hull, HasNumbersWhateverItsPicturesAndWhereverTheViewer) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  Filmed person = filmed({0, 60}, walker_from);
  const auto own = person.pictures;
  for (const std::array<float, 4>& rgba : {std::array{1.F, 1.F, 1.F, 1.F},
                                           {0.F, 0.F, 0.F, 1.F},
                                           {nan, nan, nan, nan},
                                           {3.F, 3.F, 3.F, 1e-30F}}) {
    person.pictures = own;
    person.pictures[1] = even_picture(rgba);
    expect_numbers(plainly_seen(person, camera_at(30)));
    person.pictures[0] = person.pictures[1];
    expect_numbers(plainly_seen(person, camera_at(100)));
  }
  person.pictures = own;
  expect_numbers(plainly_seen(person, camera_at(30, 0.3)));  // in the box
  // Cameras in it, or that look away, and a box that is none.
  person.views[1].camera = camera_at(60, 0.2);
  expect_numbers(plainly_seen(person, camera_at(30)));
  person.views[1].camera.cam_from_set = calibrate::look_at({0, 3, 1}, {0, 6, 1}, 0);
  expect_numbers(plainly_seen(person, camera_at(30)));
  for (const float size : {0.0F, 1e-20F, 1e5F}) {
    render::SceneDescription scene = scene_with(person.views);
    scene.instances[0].set_from_object = placed_box({}, {size, size, size});
    expect_numbers(rendered(plain(shot_of(scene, person.pictures, camera_at(30)))));
  }
}

TEST(Hull, RefusesWhatCannotBeShown) {
  const Filmed person = filmed({0, 60}, walker_from);
  const std::vector<HullView>& views = person.views;
  EXPECT_THROW(make_hull_material("p", {}, std::span(views).first(1)), std::invalid_argument);
  EXPECT_THROW(make_hull_material("p", {}, std::vector<HullView>(9, views[0])),
               std::invalid_argument);
  EXPECT_THROW(make_hull_material("p", {.step_px = 0}, views), std::invalid_argument);
  EXPECT_THROW(make_hull_material("p", {.gain = {1, -1, 1}}, views), std::invalid_argument);
  std::vector<HullView> wide = views;
  wide[1].camera.lens = {"equisolid", width, height, {50, 80, 60}};
  EXPECT_THROW(make_hull_material("p", {}, wide), std::invalid_argument);
  render::SceneDescription scene = scene_with(views);
  EXPECT_THROW(render::Scene{scene}, std::invalid_argument);  // no pictures
  EXPECT_THROW(render::Scene(scene, {person.pictures[0]}), std::invalid_argument);
  const auto broken = [&](auto&& breaks) {
    render::SceneDescription other = scene;
    HullBlock block;
    std::memcpy(&block, other.materials[0].parameters.data(), sizeof block);
    breaks(block);
    std::memcpy(other.materials[0].parameters.data(), &block, sizeof block);
    EXPECT_THROW(render::Scene(other, person.pictures), std::invalid_argument);
  };
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  broken([](HullBlock& b) { b.views = 1; });
  broken([](HullBlock& b) { b.views = 9; });
  broken([](HullBlock& b) { b.step_px = nan; });
  broken([](HullBlock& b) { b.view[1].camera.cam_from_set[3] = nan; });
  broken([](HullBlock& b) { b.view[1].position.x = nan; });
  broken([](HullBlock& b) { b.view[1].px_per_tangent = 0; });
  broken([](HullBlock& b) { b.view[1].first_byte += 8; });
  broken([](HullBlock& b) { b.view[1].camera.rows = 1000; });
  broken([](HullBlock& b) { b.view[0].camera.columns = 0; });
  scene.materials[0].parameters.resize(20);
  EXPECT_THROW(render::Scene(scene, person.pictures), std::invalid_argument);
}

}  // namespace
}  // namespace compositing::visual_hull_test
