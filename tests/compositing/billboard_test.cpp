// Billboards: what rays of every kind see of a keyed picture.
#include "compositing/billboard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "compositing/keyed_picture.h"
#include "furnished_scene.h"
#include "made_shot.h"
#include "render/kept_transport.h"
#include "render/ray_log.h"
#include "render/reference.h"
#include "render/trace.h"

namespace compositing::billboard_test {
namespace {

using render::Vec3f;

constexpr int width = 160, height = 120;

// A picture of (height, width, 4) from a function of its pixels.
template <class F>
std::shared_ptr<const KeyedPicture> picture_from(int w, int h, F&& rgba_at) {
  capture::Image image = capture::make_image(h, w, 4);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const std::array<float, 4> rgba = rgba_at(x, y);
      for (int c = 0; c < 4; ++c) image.at(y, x, c) = rgba[static_cast<std::size_t>(c)];
    }
  }
  return std::make_shared<KeyedPicture>(make_keyed_texture(image));
}

// A soft-edged figure: a head and a body, of two colours.
std::shared_ptr<const KeyedPicture> figure(float shift = 0) {
  return picture_from(96, 192, [&](int x, int y) {
    const float px = (static_cast<float>(x) + 0.5F) / 96 - 0.5F - shift;
    const float py = (static_cast<float>(y) + 0.5F) / 192;
    const float head = 0.13F - std::hypot(px, (py - 0.16F) * 2);
    const float body = 0.22F - std::abs(px) - 0.1F * std::abs(py - 0.6F);
    const float within = std::max(head, py > 0.25F && py < 0.98F ? body : -1.0F);
    const float alpha = std::clamp(0.5F + within * 30, 0.0F, 1.0F);
    const bool above = py < 0.27F;
    return std::array{alpha * (above ? 0.7F : 0.1F), alpha * (above ? 0.5F : 0.2F),
                      alpha * (above ? 0.4F : 0.6F), alpha};
  });
}

std::array<float, 12> standing(Vec3f at, float wide, float high) {
  return {wide, 0, 0, at.x, 0, 1, 0, at.y, 0, 0, high, at.z};
}

// A billboard 1 m wide and 2 m high at the set's origin, before a camera that looks along +y.
MadeShot shot_of(render::SceneDescription scene, render::Scene::Pictures pictures) {
  MadeShot shot;
  shot.scene = std::make_unique<render::Scene>(std::move(scene), std::move(pictures));
  const double f = width * 1.1;
  shot.directions = calibrate::make_direction_table(
      {"pinhole", width, height, {f, f, (width - 1) / 2.0, (height - 1) / 2.0}});
  shot.environment = made_sky(32, 0.1F, 1);
  shot.plate = made_plate(height, width);
  shot.job.cam_from_set = calibrate::look_at({0.3, -4, 1.6}, {0, 0, 0.9}, 0);
  shot.job.lights = even_lights(64);
  return shot;
}

render::SceneDescription scene_with(const render::Material& material) {
  register_shaders();
  render::SceneDescription scene;
  scene.background = "plate";
  scene.materials = {material};
  scene.meshes = {std::make_shared<render::Mesh>(make_billboard_mesh(0))};
  render::Instance& person = scene.instances.emplace_back();
  person.name = "person";
  person.set_from_object = standing({0, 0, 0}, 1, 2);
  person.moves = true;
  return scene;
}

capture::Image picture_of(const MadeShot& shot, render::KeptTransport* kept = nullptr) {
  render::FrameResult result;
  render::FrameInputs inputs = shot.inputs();
  inputs.kept = kept;
  render::render_frame(inputs, shot.job, shot.plate, result);
  return capture::to_float(result.rgba);
}

// What is seen from the person's own camera is its picture, wherever the rectangle stands.
TEST(Billboard, ShowsItsPictureToWithinATenthOfAPixelFromItsOwnCamera) {
  const calibrate::Lens pinhole{"pinhole", width, height, {170, 171, 81.3, 57.9}};
  const calibrate::Lens barrel{
      "LENSMODEL_OPENCV4", width, height, {150, 151, 80.2, 58.7, -0.21, 0.05, 0.001, -0.002}};
  const calibrate::Lens fish_eye{
      "kannala_brandt", width, height, {110, 110, 79, 60, -0.02, 0.003, 0, 0}};
  // Twice as large as the picture that the lens is for; each texel tells its place.
  const auto places = picture_from(2 * width, 2 * height, [](int x, int y) {
    return std::array{(static_cast<float>(x) + 0.5F) / (2 * width),
                      (static_cast<float>(y) + 0.5F) / (2 * height), 0.0F, 1.0F};
  });
  for (const calibrate::Lens& lens : {pinhole, barrel, fish_eye}) {
    for (const float away : {0.0F, 3.0F}) {
      const calibrate::Pose cam_from_set = calibrate::look_at({0.7, -4, 1.4}, {0.1, 0, 1}, 0.05);
      render::SceneDescription scene =
          scene_with(make_billboard_material("person", {}, {lens, cam_from_set}));
      scene.instances[0].set_from_object = standing({-30, away, -30}, 60, 60);
      scene.instances[0].set_from_object[3] = 0;
      MadeShot shot = shot_of(std::move(scene), {places});
      shot.directions = calibrate::make_direction_table(lens);
      shot.job.cam_from_set = cam_from_set;
      shot.job.effort.aa_samples = 1;
      const capture::Image seen = picture_of(shot);
      double worst = 0;
      for (int y = 2; y < height - 2; ++y) {
        for (int x = 2; x < width - 2; ++x) {
          ASSERT_GT(seen.at(y, x, 3), 0.99) << x << " " << y << " " << lens.model;
          worst = std::max({worst, std::abs(double{seen.at(y, x, 0)} * width - 0.5 - x),
                            std::abs(double{seen.at(y, x, 1)} * height - 0.5 - y)});
        }
      }
      EXPECT_LT(worst, 0.1) << lens.model << " " << away;  // half floats: .04 at the far side
    }
  }
}

TEST(Billboard, LeavesThePlateItsBitsWhereItIsClear) {
  const auto clear = picture_from(8, 8, [](int, int) { return std::array<float, 4>{}; });
  const MadeShot shot = shot_of(scene_with(make_billboard_material("person", {})), {clear});
  const capture::Image seen = picture_of(shot);
  const capture::Image plate = capture::to_float(shot.plate);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < 3; ++c) ASSERT_EQ(seen.at(y, x, c), plate.at(y, x, c));
      ASSERT_EQ(seen.at(y, x, 3), 0);
    }
  }
}

// Shows hardly anything where there is nothing, so that no ray passes at once.
class Unsure final : public render::LivePicture {
 public:
  explicit Unsure(std::shared_ptr<const LivePicture> picture) : picture_(std::move(picture)) {}
  std::array<float, 4> look_up(float u, float v, float footprint_uv) const override {
    std::array<float, 4> rgba = picture_->look_up(u, v, footprint_uv);
    rgba[0] = std::max(rgba[0], 1e-9F);
    return rgba;
  }

 private:
  std::shared_ptr<const LivePicture> picture_;
};

// A small figure in a wide picture, of which the most is clear.
std::shared_ptr<const KeyedPicture> small_figure() {
  return picture_from(320, 320, [](int x, int y) {
    const float within = 40 - std::hypot(static_cast<float>(x) - 150, static_cast<float>(y) - 220);
    const float alpha = std::clamp(0.5F + within / 4, 0.0F, 1.0F);
    return std::array{0.6F * alpha, 0.3F * alpha, 0.1F * alpha, alpha};
  });
}

// Rays that pass at once see what those see that are sent on, at any distance.
TEST(Billboard, ShowsTheSameWhereItIsPassedAtOnce) {
  const auto see = [&](std::shared_ptr<const render::LivePicture> picture, float away,
                       bool furnished, bool lit = false) {
    render::SceneDescription scene = scene_with(make_billboard_material("person", {.lit = lit}));
    if (furnished) furnish(scene, {0.9F, 1.4F}, {0.55F, -0.6F, 0.6F});
    scene.instances[0].set_from_object = standing({0, away, 0}, 3, 3);
    const MadeShot shot = shot_of(std::move(scene), {std::move(picture)});
    render::FrameResult result;
    render::render_frame(shot.inputs(), shot.job, shot.plate, result);
    return result;
  };
  const capture::Image plate = capture::to_float(made_plate(height, width));
  for (const float away : {0.0F, 40.0F}) {
    const capture::Image seen = capture::to_float(see(small_figure(), away, true).rgba);
    const capture::Image truth =
        capture::to_float(see(std::make_shared<Unsure>(small_figure()), away, true).rgba);
    const capture::Image mask = render::affected_mask(truth, plate);
    EXPECT_LT(render::picture_error(seen, truth, mask).relative_rms, 0.01) << away;
  }
  // What is lit is met by the set's own rays (others' by rays to pictures alone).
  const auto rays = [&](std::shared_ptr<const render::LivePicture> picture) {
    return see(std::move(picture), 0, false, true).statistics.secondary_rays;
  };
  EXPECT_LT(rays(small_figure()), rays(std::make_shared<Unsure>(small_figure())) / 2);
  // Close to what is seen, too: a dot in every block of texels.
  const auto dots = picture_from(64, 64, [](int x, int y) {
    const float alpha = x % 8 == 3 && y % 8 == 3 ? 0.5F : 0.0F;
    return std::array{0.0F, 0.0F, 0.0F, alpha};
  });
  EXPECT_GT(rays(dots), 0U);
  EXPECT_LT(rays(dots), rays(std::make_shared<Unsure>(dots)) / 4);
}

// What the kernel is measured against are the rays that it shot, as far as they went.
TEST(Billboard, IsPassedByLoggedRaysAsByTheirOriginals) {
  const auto clear = picture_from(64, 64, [](int, int) { return std::array<float, 4>{}; });
  const MadeShot shot = shot_of(scene_with(make_billboard_material("person", {})), {clear});
  std::vector<render::RayLog> logs(1);
  const render::FrameContext context = render::make_frame_context(shot.inputs(), shot.job);
  render::TileWorkspace workspace;
  workspace.log_rays(&logs[0]);
  render::TileJob tile;
  render::TileResult result;
  const render::Rect picture{0, 0, width, height};
  cut_tile(shot.plate, picture, 0, tile);
  size_result(picture, result);
  render_tile(context, tile, workspace, result);
  EXPECT_EQ(result.statistics.secondary_rays, 0U);
  EXPECT_GE(logs[0].mask.size(), static_cast<std::size_t>(width * height));
  EXPECT_EQ(shoot_logged_rays(*shot.scene, logs, true), 0U);
}

// A person on a floor that catches the shadow, with a mirror behind and a glass ball in front.
render::SceneDescription furnished(bool lit = false, float translucency = 0) {
  render::SceneDescription scene =
      scene_with(make_billboard_material("person", {.lit = lit, .translucency = translucency}));
  furnish(scene, {0.9F, 1.4F}, {0.55F, -0.6F, 0.6F});
  return scene;
}

// Of a real floor that hides nothing, a picture's clear part before it hides nothing either.
TEST(Billboard, ShowsTheFloorBehindWhereItIsClearAlsoIfThatHidesNothing) {
  const auto see = [](std::shared_ptr<const render::LivePicture> picture) {
    render::SceneDescription scene = scene_with(make_billboard_material("person", {}));
    furnish(scene, {0.9F, 1.4F}, {0.55F, -0.6F, 0.6F});
    scene.instances[0].set_from_object = standing({0, 0, 0}, 3, 3);
    scene.instances[1].occludes = false;
    return picture_of(shot_of(std::move(scene), {std::move(picture)}));
  };
  const capture::Image seen = see(small_figure());
  const capture::Image truth = see(std::make_shared<Unsure>(small_figure()));
  const capture::Image mask =
      render::affected_mask(truth, capture::to_float(made_plate(height, width)));
  EXPECT_LT(render::picture_error(seen, truth, mask).relative_rms, 0.01);
}

TEST(Billboard, LetsLightThroughThinClothInItsColour) {
  const auto passes = [](float translucency, float alpha) {
    constexpr std::array colour{0.9F, 0.2F, 0.0F};
    const auto cloth = picture_from(16, 32, [&](int, int) {
      return std::array{alpha * colour[0], alpha * colour[1], alpha * colour[2], alpha};
    });
    const render::Scene scene(
        scene_with(make_billboard_material("person", {.translucency = translucency})), {cloth});
    return render::transmittance(scene, {0.1F, -2, 1.1F}, {0, 1, 0}, 0, render::ray_far,
                                 render::mask_virtual);
  };
  const Vec3f grey = passes(0, 0.5F), thin = passes(1, 0.5F), half = passes(0.5F, 0.5F);
  for (const float value : {grey.x, grey.y, grey.z}) EXPECT_NEAR(value, 0.5F, 1e-3F);
  EXPECT_NEAR(thin.x, 0.5F * 1.45F, 1e-3F);
  EXPECT_NEAR(thin.y, 0.5F * 1.1F, 1e-3F);
  EXPECT_NEAR(thin.z, 0.5F, 1e-3F);
  EXPECT_NEAR(half.x, 0.5F * 1.225F, 1e-3F);
  EXPECT_EQ(passes(1, 1), Vec3f{});
  EXPECT_EQ(passes(1, 0), (Vec3f{1, 1, 1}));
  EXPECT_THROW(make_billboard_material("p", {.translucency = 1.5F}), std::invalid_argument);
  EXPECT_THROW(make_billboard_material("p", {.lit = true, .translucency = 0.5F}),
               std::invalid_argument);
}

// Glowing, and lit; and with cloth that colours its shadow.
TEST(Billboard, CastsShadowsAndIsMirroredAndRefractedAsTheReferenceHasIt) {
  for (const auto& [lit, translucency] : {std::pair(false, 0.0F), {true, 0.0F}, {false, 0.8F}}) {
    MadeShot shot = shot_of(furnished(lit, translucency), {figure()});
    shot.job.effort.light_samples = 256;
    shot.job.lights = even_lights(256);
    shot.job.effort.accuracy = 0.99F;
    shot.job.effort.aa_tolerance = 0.02F;
    if (lit) shot.environment = made_sky(32, 0, 1);  // all of its light is in the table
    const capture::Image seen = picture_of(shot);
    const capture::Image plate = capture::to_float(shot.plate);
    render::ReferenceSettings settings;
    settings.samples = 256;
    const capture::Image truth = render_reference(shot.inputs(), shot.job, plate, settings);
    settings.seed = 2;
    const capture::Image again = render_reference(shot.inputs(), shot.job, plate, settings);
    const capture::Image mask = render::affected_mask(truth, plate);
    EXPECT_LT(render::picture_error(seen, {truth, again}, mask).relative_rms, 0.01)
        << lit << " " << translucency;
  }
}

constexpr std::array albedo{0.6F, 0.3F, 0.1F};

// Everywhere the same, of that albedo.
std::shared_ptr<const KeyedPicture> board(float alpha) {
  return picture_from(16, 32, [&](int, int) {
    return std::array{alpha * albedo[0], alpha * albedo[1], alpha * albedo[2], alpha};
  });
}

// A board over a floor, in the shadow of a ball.
render::SceneDescription shaded(const render::Material& material) {
  render::SceneDescription scene = scene_with(material);
  scene.materials.push_back(make_stand_in_material("floor", {}));
  scene.materials.push_back(render::make_standard_material("ball", {}));
  scene.meshes.push_back(made_floor(20, 1));
  scene.meshes.push_back(made_ball({0.3F, -0.7F, 1.7F}, 0.3F, 2));
  for (std::uint32_t mesh = 1; mesh < 3; ++mesh) scene.instances.emplace_back().mesh = mesh;
  scene.instances[1].kind = render::ObjectKind::stand_in;
  scene.instances[1].blocks_light = false;
  return scene;
}

render::FrameResult rendered(const MadeShot& shot) {
  render::FrameResult result;
  render::render_frame(shot.inputs(), shot.job, shot.plate, result);
  return result;
}

TEST(Billboard, IsWhenLitAsAMatteBoardOfItsAlbedo) {
  render::StandardParameters paint;
  std::ranges::copy(albedo, paint.base_color);
  paint.roughness = 1;
  paint.specular = 0;
  // Each pixel tests each light: what is shared between neighbours depends on where edges are.
  const auto seen_of = [](const render::Material& material, render::Scene::Pictures pictures) {
    MadeShot shot = shot_of(shaded(material), std::move(pictures));
    shot.job.effort.adaptive_visibility = shot.job.effort.soft_lights = false;
    shot.job.effort.aa_samples = 1;
    return picture_of(shot);
  };
  const capture::Image board_seen = seen_of(render::make_standard_material("board", paint), {});
  const capture::Image lit_seen =
      seen_of(make_billboard_material("person", {.lit = true}), {board(1)});
  int compared = 0;
  float darkest = 1e9F, brightest = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (lit_seen.at(y, x, 3) < 1 || board_seen.at(y, x, 3) < 1) continue;
      const float red = board_seen.at(y, x, 0);
      if (std::abs(red - 6 * board_seen.at(y, x, 2)) > 0.01F * red) continue;  // the ball's
      ++compared;
      for (int c = 0; c < 3; ++c) {
        ASSERT_NEAR(lit_seen.at(y, x, c), board_seen.at(y, x, c), 0.001F) << x << " " << y;
      }
      darkest = std::min(darkest, lit_seen.at(y, x, 0));
      brightest = std::max(brightest, lit_seen.at(y, x, 0));
    }
  }
  EXPECT_GT(compared, 2000);
  EXPECT_LT(darkest, 0.9F * brightest) << "the ball's shadow is on it";
}

TEST(Billboard, LetsLightThroughByAlphaWhenLit) {
  const auto of = [](float alpha) {
    return rendered(
        shot_of(shaded(make_billboard_material("person", {.lit = true})), {board(alpha)}));
  };
  constexpr float alpha = 0.4F;
  const render::FrameResult none = of(0), part = of(alpha), whole = of(1);
  const auto at = [](const capture::HalfImage& image, std::size_t i) {
    return capture::float_from_half(image.pixels[i]);
  };
  int on_board = 0, in_shadow = 0;
  for (std::size_t i = 0; i < part.matte.pixels.size(); ++i) {
    // A pixel of the board, before the floor or the plate; or of the floor in the board's shadow.
    const bool board_only = at(whole.rgba, i * 4 + 3) == 1 && at(none.rgba, i * 4 + 3) == 0;
    const bool floor_only = at(whole.rgba, i * 4 + 3) == 0;
    const float darker = at(whole.matte, i) - at(none.matte, i);
    if (!board_only && !(floor_only && darker > 0.05F)) continue;
    for (std::size_t c = 0; c < 4; ++c) {
      const float mixed =
          (1 - alpha) * at(none.rgba, i * 4 + c) + alpha * at(whole.rgba, i * 4 + c);
      // Behind the board, the floor is in its shadow as well.
      ASSERT_NEAR(at(part.rgba, i * 4 + c), mixed, board_only && c < 3 ? 0.06F : 0.01F) << i;
    }
    (board_only ? on_board : in_shadow) += 1;
  }
  EXPECT_GT(on_board, 1000);
  EXPECT_GT(in_shadow, 200);
}

// Light through cloth is found by shadow rays and by paths: the reference has to weigh one light.
TEST(Billboard, LetsAsMuchLightThroughClothInTheReferenceWithAllBounces) {
  const auto floor_under = [](float translucency, bool bounces) {
    render::SceneDescription scene =
        scene_with(make_billboard_material("person", {.gain = {}, .translucency = translucency}));
    render::StandardParameters paint;
    std::ranges::fill(paint.base_color, 0.5F);
    paint.roughness = 1;
    paint.specular = 0;
    scene.materials.push_back(render::make_standard_material("floor", paint));
    scene.meshes.push_back(made_floor(3, 1));
    scene.instances.emplace_back().mesh = 1;
    scene.instances[0].set_from_object = {40, 0, 0, 0, 0, 0, 40, -20, 0, 1, 0, 3};
    const auto cloth = picture_from(16, 16, [](int, int) {
      return std::array{0.5F, 0.25F, 0.0F, 0.5F};
    });
    const MadeShot shot = shot_of(std::move(scene), {cloth});
    const render::ReferenceSettings settings{.samples = 64, .bounces = bounces};
    const capture::Image seen =
        render_reference(shot.inputs(), shot.job, capture::to_float(shot.plate), settings);
    Vec3f sum;
    for (int y = 90; y < 110; ++y) {
      for (int x = 70; x < 90; ++x) sum += {seen.at(y, x, 0), seen.at(y, x, 1), seen.at(y, x, 2)};
    }
    return sum * (1 / 400.0F);
  };
  for (const bool bounces : {false, true}) {
    const Vec3f grey = floor_under(0, bounces), thin = floor_under(1, bounces);
    EXPECT_NEAR(thin.x / grey.x, 1.5F, 0.02F) << bounces;
    EXPECT_NEAR(thin.y / grey.y, 1.25F, 0.02F) << bounces;
    EXPECT_NEAR(thin.z / grey.z, 1, 0.02F) << bounces;
  }
}

TEST(Billboard, IsTheSameWithWhatIsKeptFromOtherPictures) {
  render::SceneDescription scene = furnished();
  render::KeptTransport kept;
  MadeShot shot = shot_of(scene, {figure()});
  std::mt19937 random(7);
  std::uniform_real_distribution<float> anywhere(-0.2F, 0.2F);
  for (int i = 0; i < 6; ++i) {
    const auto shown = figure(anywhere(random));
    if (i % 2 == 1) scene.instances[0].set_from_object = standing({anywhere(random), 0, 0}, 1, 2);
    shot.scene =
        std::make_unique<render::Scene>(scene, *shot.scene, render::Scene::Pictures{shown});
    const capture::Image warm = picture_of(shot, &kept);
    const capture::Image cold = picture_of(shot);
    ASSERT_EQ(warm.pixels, cold.pixels) << i;
  }
  // Where a picture stays, so does all that was found with it.
  picture_of(shot, &kept);
  const auto stages = kept.stages();
  EXPECT_EQ(std::ranges::count(stages, render::KeptTransport::none), 0);
}

TEST(KeyedPicture, IsNothingBeyondItsRimAndHasNoNumbersThatAreNone) {
  const auto white = picture_from(4, 2, [](int, int) { return std::array{1.F, 1.F, 1.F, 1.F}; });
  for (const auto& [u, v] : {std::pair(-0.1F, 0.5F), {1.1F, 0.5F}, {0.5F, -0.2F}, {0.5F, 1.2F}}) {
    EXPECT_EQ(white->look_up(u, v, 0)[3], 0) << u << " " << v;
  }
  EXPECT_NEAR(white->look_up(0, 0.5F, 0.1F)[3], 0.5, 1e-5);
  EXPECT_NEAR(white->look_up(0.5F, 0.5F, 0.3F)[3], 1, 1e-5);
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  for (const float bad : {nan, std::numeric_limits<float>::infinity()}) {
    for (const auto& rgba : {white->look_up(bad, 0.5F, 0), white->look_up(0.5F, bad, 0.1F),
                             white->look_up(0.5F, 0.5F, bad)}) {
      for (const float value : rgba) {
        EXPECT_GE(value, 0);
        EXPECT_LE(value, 1);
      }
    }
  }
  EXPECT_THROW(KeyedPicture(nullptr), std::invalid_argument);
}

TEST(KeyedPicture, HasNoAlphaBeyondItsBound) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> one(0, 1);
  capture::Image image = capture::make_image(53, 91, 4);
  for (int i = 0; i < 40; ++i) {
    const auto y = static_cast<int>(52 * one(random)), x = static_cast<int>(90 * one(random));
    for (int c = 0; c < 4; ++c) image.at(y, x, c) = one(random);
  }
  const KeyedPicture picture(make_keyed_texture(image), true);
  int useful = 0;
  for (int i = 0; i < 20000; ++i) {
    const float u = 1.2F * one(random) - 0.1F, v = 1.2F * one(random) - 0.1F;
    const float footprint = 0.2F * one(random) * one(random);
    const float reach = 1.5F * footprint;
    const float most = picture.most_alpha(u - reach, v - reach, u + reach, v + reach);
    ASSERT_LE(picture.look_up(u, v, footprint)[3], most + 1e-6F)
        << u << " " << v << " " << footprint;
    useful += most < 0.5F;
  }
  EXPECT_GT(useful, 1000);
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(picture.most_alpha(nan, 0, 1, 1), 1);
  EXPECT_LE(picture.most_alpha(-5, -5, 7, 7), 1);
}

TEST(Billboard, RefusesWhatCannotBeShown) {
  const calibrate::Pose here = calibrate::look_at({0, -4, 1}, {0, 0, 1}, 0);
  const calibrate::Lens wide{"equisolid", width, height, {50, 80, 60}};
  EXPECT_THROW(make_billboard_material("p", {}, {wide, here}), std::invalid_argument);
  BillboardSettings bright;
  bright.gain[1] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(make_billboard_material("p", bright), std::invalid_argument);
  render::SceneDescription scene = scene_with(make_billboard_material("p", {}));
  EXPECT_THROW(render::Scene{scene}, std::invalid_argument);  // no picture
  scene.instances[0].moves = false;
  EXPECT_THROW(render::Scene(scene, {figure()}), std::invalid_argument);
  scene.instances[0].moves = true;
  scene.materials[0].parameters.resize(20);
  EXPECT_THROW(render::Scene(scene, {figure()}), std::invalid_argument);
}

}  // namespace
}  // namespace compositing::billboard_test
