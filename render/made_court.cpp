// The made court, piece by piece.
#include "render/made_court.h"

#include <array>
#include <string>
#include <utility>

#include "render/made_scene.h"
#include "render/made_shapes.h"
#include "render/made_surfaces.h"

namespace render {
namespace {

constexpr float half_paved = court_m / 2;
constexpr float front_y = court_middle_y - half_paved;
constexpr float back_y = court_middle_y + half_paved;
constexpr float kerb_height = 0.14F;
constexpr float wall_y = back_y + 2.2F;
constexpr float wall_height = 2.4F;
constexpr float far_m = 150;  // where the ground ends

// Rough ground hides its own glints: hardly any mirrored light leaves it.
constexpr float rough_paving = 0.1F;

constexpr std::array<float, 3> pale{1, 1, 1};

void add_paving(MadeSceneBuilder& court, int texture_size, std::uint32_t seed) {
  const auto asphalt = court.add(make_court_texture(texture_size, seed));
  const auto paving = court.add(make_paving_texture(std::max(texture_size / 4, 1), seed + 1));
  court.add("court", make_rectangle({-half_paved, front_y, 0}, {court_m, 0, 0}, {0, court_m, 0}, 0),
            pale, 0.85F, asphalt, rough_paving);
  constexpr float slab_tile = 2.4F;
  const float depth = 2 * far_m;
  Mesh around =
      make_rectangle({-far_m, back_y, kerb_height}, {depth, 0, 0}, {0, far_m, 0}, slab_tile);
  append(around,
         make_rectangle({-far_m, front_y - far_m, 0}, {depth, 0, 0}, {0, far_m, 0}, slab_tile));
  append(around, make_rectangle({-far_m, front_y, kerb_height}, {far_m - half_paved, 0, 0},
                                {0, court_m, 0}, slab_tile));
  append(around, make_rectangle({half_paved, front_y, kerb_height}, {far_m - half_paved, 0, 0},
                                {0, court_m, 0}, slab_tile));
  court.add("paving", std::move(around), pale, 0.9F, paving, rough_paving);
}

void add_concrete(MadeSceneBuilder& court, int texture_size, std::uint32_t seed) {
  const auto concrete = court.add(make_concrete_texture(std::max(texture_size / 8, 1), seed + 2));
  const auto wall = court.add(make_wall_texture(std::max(texture_size / 4, 1), seed + 3));
  Mesh kerbs;
  constexpr float stone = 1.0F;
  constexpr float gap = 0.008F;
  for (int i = 0; i < static_cast<int>(court_m); ++i) {
    const float from = static_cast<float>(i) * stone;
    const Mesh piece =
        make_box({gap, 0, -0.1F}, {stone - gap, 0.16F, kerb_height + 0.01F}, 0.018F, 1.3F);
    append(kerbs, piece, {-half_paved + from, back_y, 0});
    for (const float side : {-half_paved - 0.16F, half_paved}) {
      append(kerbs,
             make_box({0, gap, -0.1F}, {0.16F, stone - gap, kerb_height + 0.01F}, 0.018F, 1.3F),
             {side, front_y + from, 0});
    }
  }
  court.add("kerb", std::move(kerbs), pale, 0.8F, concrete, rough_paving);

  Mesh panels;
  constexpr float tile = wall_height;  // two panels wide
  constexpr int first_panel = -9;
  constexpr int last_panel = 16;
  for (int i = first_panel; i < last_panel; ++i) {
    append(panels, make_rectangle({tile * static_cast<float>(i), wall_y, kerb_height}, {tile, 0, 0},
                                  {0, 0, wall_height}, 0));
  }
  court.add("wall", std::move(panels), pale, 0.75F, wall, rough_paving);
  court.add("coping",
            make_box({first_panel * tile, wall_y - 0.05F, kerb_height + wall_height},
                     {last_panel * tile, wall_y + 0.35F, kerb_height + wall_height + 0.09F}, 0.015F,
                     1.1F),
            pale, 0.8F, concrete, rough_paving);
}

void add_things(MadeSceneBuilder& court, int texture_size, std::uint32_t seed) {
  const auto boards = court.add(make_board_texture(std::max(texture_size / 4, 1), seed + 4));
  Mesh crates;
  const Vec3f half = court_crate.size * 0.5F;
  append(crates,
         make_box({-half.x, -half.y, 0}, {half.x, half.y, court_crate.size.z}, 0.012F, 1.0F),
         court_crate.middle, court_crate.yaw_rad);
  append(crates, make_box({-0.45F, -0.45F, 0}, {0.45F, 0.45F, 0.8F}, 0.012F, 0.9F),
         {-5.6F, 6.0F, 0}, -0.3F);
  append(crates, make_box({-0.3F, -0.3F, 0}, {0.3F, 0.3F, 0.55F}, 0.012F, 0.7F),
         {-5.5F, 6.05F, 0.8F}, 0.2F);
  append(crates, make_box({-0.35F, -0.35F, 0}, {0.35F, 0.35F, 0.7F}, 0.012F, 0.8F),
         {-6.7F, 6.3F, 0}, 0.5F);
  court.add("crates", std::move(crates), pale, 0.7F, boards);

  const MadeCard& card = court_card;
  Mesh sheet;
  append(sheet,
         make_rectangle({-card.width / 2, -card.depth / 2, 0}, {card.width, 0, 0},
                        {0, card.depth, 0}, 0),
         card.middle, card.yaw_rad);
  court.add("grey card", std::move(sheet), {card.albedo, card.albedo, card.albedo}, 1, -1, 0);

  constexpr std::array<std::array<float, 2>, 2> cones{{{-4.1F, 2.2F}, {-3.1F, 4.0F}}};
  Mesh orange;
  Mesh rings;
  for (const auto& [x, y] : cones) {
    constexpr std::array<std::array<float, 2>, 4> body{
        {{0.165F, 0.03F}, {0.128F, 0.20F}, {0.031F, 0.68F}, {0, 0.68F}}};
    append(orange, make_lathe(body, 48, 1), {x, y, 0});
    append(orange, make_box({-0.2F, -0.2F, 0}, {0.2F, 0.2F, 0.03F}, 0.006F, 1), {x, y, 0}, 0.4F);
    constexpr std::array<std::array<float, 2>, 2> ring{{{0.1045F, 0.33F}, {0.0745F, 0.48F}}};
    append(rings, make_lathe(ring, 48, 1), {x, y, 0});
  }
  court.add("cones", std::move(orange), {0.78F, 0.13F, 0.02F}, 0.45F);
  court.add("cone rings", std::move(rings), {0.75F, 0.75F, 0.73F}, 0.4F);

  Mesh posts;
  constexpr std::array<std::array<float, 2>, 4> post{
      {{0.055F, 0}, {0.055F, 0.86F}, {0.04F, 0.9F}, {0, 0.9F}}};
  for (int i = -2; i <= 2; ++i) {
    append(posts, make_lathe(post, 32, 1),
           {2.6F * static_cast<float>(i) + 1.3F, back_y + 0.5F, kerb_height});
  }
  court.add("bollards", std::move(posts), {0.55F, 0.40F, 0.03F}, 0.4F);

  Mesh lamp;
  constexpr std::array<std::array<float, 2>, 6> pole{
      {{0.11F, 0}, {0.11F, 0.5F}, {0.07F, 0.55F}, {0.05F, 5.4F}, {0.02F, 5.45F}, {0, 5.45F}}};
  append(lamp, make_lathe(pole, 40, 1), {6.4F, back_y + 1.0F, kerb_height});
  append(lamp, make_box({-1.2F, -0.03F, 5.3F}, {0, 0.03F, 5.36F}, 0.008F, 1),
         {6.4F, back_y + 1.0F, kerb_height});
  append(lamp, make_box({-1.75F, -0.13F, 5.25F}, {-1.15F, 0.13F, 5.37F}, 0.03F, 1),
         {6.4F, back_y + 1.0F, kerb_height});
  court.add("lamp post", std::move(lamp), {0.55F, 0.56F, 0.57F}, 0.5F, -1, 1, 1);
}

}  // namespace

SceneDescription make_court(const MadeCourtSettings& settings) {
  MadeSceneBuilder court;
  add_paving(court, settings.texture_size, settings.seed);
  add_concrete(court, settings.texture_size, settings.seed);
  add_things(court, settings.texture_size, settings.seed);
  return court.take();
}

}  // namespace render
