// The made living room, piece by piece.
#include "render/made_tv_room.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "render/made_scene.h"
#include "render/made_shapes.h"
#include "render/made_surfaces.h"
#include "render/standard.h"

namespace render {
namespace {

using Base = std::array<float, 3>;
using Profile = std::vector<std::array<float, 2>>;

constexpr float left = -2.4F, right = 2.4F, back = 2.2F, front = -3.4F, height = 2.55F;
constexpr std::string_view all_faces = "-x +x -y +y -z +z";
constexpr Base white{1, 1, 1};
constexpr Base walnut{0.12F, 0.055F, 0.028F};
constexpr Vec3f lamp_foot{-1.75F, 1.75F, 0};

Material shining(const std::string& name, Base base, float roughness, float metallic, float coat) {
  StandardParameters p;
  std::ranges::copy(base, p.base_color);
  p.roughness = roughness;
  p.metallic = metallic;
  p.clearcoat = coat;
  p.specular = coat > 0 ? 0.1F : 1.0F;  // the coat is what shines
  return make_standard_material(name, p);
}

Material glowing(const std::string& name, Base base, Base radiance, std::int32_t texture = -1) {
  StandardParameters p;
  std::ranges::copy(base, p.base_color);
  std::ranges::copy(radiance, p.emission);
  p.emission_texture = texture;
  p.roughness = 0.9F;
  p.specular = 0;
  return make_standard_material(name, p);
}

void add_room(MadeSceneBuilder& room) {
  const auto boards = room.add(make_board_texture(512, 21));
  StandardParameters parquet;
  parquet.base_color_texture = boards;
  parquet.roughness = 0.7F;
  parquet.specular = 0.1F;
  parquet.clearcoat = 1;
  room.add("floor",
           make_rectangle({left, front, 0}, {right - left, 0, 0}, {0, back - front, 0}, 1.1F),
           make_standard_material("floor", parquet));
  Mesh walls = make_rectangle({left, back, 0}, {right - left, 0, 0}, {0, 0, height}, 1);
  append(walls, make_rectangle({left, front, 0}, {0, back - front, 0}, {0, 0, height}, 1));
  append(walls, make_rectangle({right, back, 0}, {0, front - back, 0}, {0, 0, height}, 1));
  room.add("walls", std::move(walls), {0.62F, 0.57F, 0.47F}, 1, -1, 0);
  room.add("ceiling", make_rectangle({left, back, height}, {right - left, 0, 0}, {0, -1.1F, 0}, 1),
           {0.78F, 0.77F, 0.74F}, 1, -1, 0);
  constexpr float thick = 0.015F, high = 0.09F;
  Mesh skirting = make_box_faces({left, back - thick, 0}, {right, back, high}, "-y +z", 1);
  append(skirting,
         make_box_faces({left, front, 0}, {left + thick, back - thick, high}, "+x +z", 1));
  append(skirting,
         make_box_faces({right - thick, front, 0}, {right, back - thick, high}, "-x +z", 1));
  room.add("skirting", std::move(skirting), {0.70F, 0.68F, 0.62F}, 1, -1, 0);
  const auto carpet = room.add(make_carpet_texture(512, 5));
  room.add("carpet", make_box_faces({-1.15F, -1.25F, 0}, {1.15F, 1.05F, 0.012F}, "+z", 0), white, 1,
           carpet, 0);
  room.add("carpet edge",
           make_box_faces({-1.15F, -1.25F, 0}, {1.15F, 1.05F, 0.012F}, "-x +x -y +y", 1),
           {0.02F, 0.03F, 0.08F}, 1, -1, 0);
}

void add_television(MadeSceneBuilder& room) {
  const Vec3f middle = tv_screen_middle;
  const float w = tv_screen_width_m / 2, h = tv_screen_height_m / 2;
  const auto picture = room.add(make_screen_texture(256));
  room.add("tv", make_rectangle(middle - Vec3f{w, 0, h}, {2 * w, 0, 0}, {0, 0, 2 * h}, 0),
           glowing("screen", {0, 0, 0}, {1, 1, 1}, picture));
  // A frame around the screen, a tube's depth behind it that gets narrower.
  constexpr float rim = 0.045F, lip = 0.012F;
  const float x0 = -w - rim, x1 = w + rim, z0 = middle.z - h - 0.09F, z1 = middle.z + h + rim;
  const float y0 = middle.y - lip, y1 = middle.y + 0.06F;
  Mesh set = make_box_faces({x0, y0, z0}, {-w, y1, z1}, "-x -y", 1);
  append(set, make_box_faces({w, y0, z0}, {x1, y1, z1}, "+x -y", 1));
  append(set, make_box_faces({-w, y0, middle.z + h}, {w, y1, z1}, "-y", 1));
  append(set, make_box_faces({-w, y0, z0}, {w, y1, middle.z - h}, "-y", 1));
  append(set, make_box_faces({x0, y0, z0}, {x1, y1, z1}, "+z", 1));
  append(set, make_rectangle({-w, y0, middle.z - h}, {0, lip, 0}, {0, 0, 2 * h}, 1));
  append(set, make_rectangle({w, middle.y, middle.z - h}, {0, -lip, 0}, {0, 0, 2 * h}, 1));
  append(set, make_rectangle({-w, y0, middle.z - h}, {2 * w, 0, 0}, {0, lip, 0}, 1));
  append(set, make_rectangle({-w, middle.y, middle.z + h}, {2 * w, 0, 0}, {0, -lip, 0}, 1));
  const float nx = w - 0.1F, nz0 = z0 + 0.02F, nz1 = z1 - 0.16F, y2 = back - 0.08F;
  const auto taper = [&](Vec3f a, Vec3f b, Vec3f c, Vec3f d) {
    Mesh face = make_rectangle(a, b - a, d - a, 1);
    face.positions = {a, b, c, d};
    face.normals.assign(4, normalize(cross(c - a, d - b)));
    append(set, face);
  };
  taper({x0, y2, z0}, {x0, y1, z0}, {x0, y1, z1}, {-nx, y2, nz1});
  taper({x1, y1, z0}, {nx, y2, nz0}, {nx, y2, nz1}, {x1, y1, z1});
  taper({x0, y1, z1}, {x1, y1, z1}, {nx, y2, nz1}, {-nx, y2, nz1});
  room.add("tv set", std::move(set), shining("tv set", {0.03F, 0.03F, 0.033F}, 0.6F, 0, 0.4F));
  room.add("tv foot", make_box_faces({-0.3F, 1.74F, 0.5F}, {0.3F, 2.05F, z0}, "-x +x -y +y", 1),
           {0.05F, 0.05F, 0.055F}, 0.6F, -1, 0.2F);
  room.add("tv light",
           make_box_faces({0.36F, y0 - 0.004F, z0 + 0.035F}, {0.372F, y0, z0 + 0.047F},
                          "-x +x -y -z +z", 1),
           glowing("tv light", {0, 0, 0}, {0.05F, 1.2F, 0.1F}));
}

void add_lowboard(MadeSceneBuilder& room) {
  constexpr float x0 = -0.95F, x1 = 0.95F, y0 = 1.62F, z0 = 0.1F, z1 = 0.5F;
  room.add("lowboard", make_box({x0, y0, z0}, {x1, back - 0.03F, z1}, 0.006F, 1),
           shining("lowboard", walnut, 0.35F, 0, 0.5F));
  Mesh doors;
  for (int i = 0; i < 3; ++i) {
    const float x = x0 + 0.02F + 0.62F * static_cast<float>(i);
    append(doors, make_box_faces({x + 0.006F, y0 - 0.014F, z0 + 0.025F},
                                 {x + 0.612F, y0, z1 - 0.03F}, "-x +x -y -z +z", 1));
  }
  room.add("doors", std::move(doors), shining("doors", {0.17F, 0.08F, 0.04F}, 0.35F, 0, 0.5F));
  const Profile knob{{0.006F, 0}, {0.006F, 0.012F}, {0.015F, 0.02F}, {0, 0.03F}};
  Mesh knobs;
  for (const float x : {-0.38F, -0.26F, 0.88F}) {
    Mesh one = make_turned(knob, 10);
    for (auto* list : {&one.positions, &one.normals}) {
      for (Vec3f& v : *list) v = {v.x, -v.z, v.y};
    }
    append(knobs, one, {x, y0 - 0.014F, 0.31F});
  }
  room.add("knobs", std::move(knobs), shining("knobs", {0.75F, 0.62F, 0.35F}, 0, 1, 0));
  const Profile foot{{0.018F, 0}, {0.03F, 0.1F}};
  Mesh feet;
  for (const float x : {x0 + 0.06F, x1 - 0.06F}) {
    for (const float y : {y0 + 0.06F, back - 0.09F}) append(feet, make_turned(foot, 12), {x, y, 0});
  }
  room.add("lowboard feet", std::move(feet), {0.03F, 0.02F, 0.015F}, 0.8F, -1, 0.1F);
}

void add_table(MadeSceneBuilder& room) {
  constexpr float half_x = 0.62F, half_y = 0.36F, top = 0.45F, thick = 0.035F;
  constexpr Vec3f middle{0.12F, -0.08F, 0};
  constexpr float yaw = 0.12F;
  Mesh board;
  append(board, make_box({-half_x, -half_y, top - thick}, {half_x, half_y, top}, 0.008F, 1), middle,
         yaw);
  // Polished, so that it shows the room upside down.
  StandardParameters polished;
  std::ranges::copy(Base{0.035F, 0.016F, 0.01F}, polished.base_color);
  polished.roughness = 0;
  polished.clearcoat = 1;
  room.add("table", std::move(board), make_standard_material("table", polished));
  const Profile leg{
      {0.019F, 0},     {0.024F, 0.03F},  {0.019F, 0.06F},  {0.031F, 0.22F},
      {0.022F, 0.33F}, {0.033F, 0.355F}, {0.033F, 0.355F}, {0.033F, top - thick - 0.012F}};
  Mesh legs;
  for (const float x : {-half_x + 0.07F, half_x - 0.07F}) {
    for (const float y : {-half_y + 0.07F, half_y - 0.07F}) {
      append(legs, make_turned(leg, 20),
             Vec3f{std::cos(yaw) * x - std::sin(yaw) * y, std::sin(yaw) * x + std::cos(yaw) * y,
                   0.012F} +
                 middle);
    }
  }
  room.add("table legs", std::move(legs), shining("table legs", walnut, 0.3F, 0, 0.5F));
  const Profile vase{{0.045F, 0},      {0.05F, 0.004F}, {0.075F, 0.05F}, {0.09F, 0.1F},
                     {0.086F, 0.15F},  {0.06F, 0.195F}, {0.034F, 0.23F}, {0.027F, 0.26F},
                     {0.033F, 0.285F}, {0.045F, 0.3F},  {0.045F, 0.3F},  {0.043F, 0.3F},
                     {0.043F, 0.3F},   {0.03F, 0.283F}, {0.024F, 0.26F}, {0.028F, 0.235F},
                     {0.0F, 0.23F}};
  Mesh turned;
  append(turned, make_turned(vase, 38), Vec3f{-0.24F, 0.02F, top});
  room.add("vase", std::move(turned), shining("vase", {0.86F, 0.84F, 0.80F}, 0, 1, 0));
  Mesh paper;
  append(paper, make_box_faces({-0.11F, -0.15F, 0}, {0.11F, 0.15F, 0.012F}, "-x +x -y +y +z", 1),
         {0.36F, -0.2F, top}, 0.5F);
  room.add("magazine", std::move(paper), {0.55F, 0.50F, 0.12F}, 0.7F, -1, 0.2F);
  Mesh remote;
  append(remote, make_box({-0.022F, -0.08F, 0}, {0.022F, 0.08F, 0.018F}, 0.004F, 1),
         {0.08F, -0.22F, top}, -0.9F);
  room.add("remote control", std::move(remote), {0.04F, 0.04F, 0.045F}, 0.7F, -1, 0.2F);
}

void add_sofa(MadeSceneBuilder& room) {
  constexpr Vec3f corner{left + 0.06F, -0.85F, 0};
  constexpr float depth = 0.88F, width = 2.0F, arm = 0.2F;
  Mesh cushions;
  const auto cushion = [&](Vec3f lower, Vec3f upper, float exponent,
                           std::string_view faces = all_faces) {
    append(cushions, make_cushion((upper - lower) * 0.5F, exponent, 5, faces),
           corner + (lower + upper) * 0.5F);
  };
  cushion({0, arm, 0.09F}, {depth, width - arm, 0.30F}, 12, "-x +x +z");
  cushion({0, 0, 0.06F}, {depth, arm, 0.60F}, 6);
  cushion({0, width - arm, 0.06F}, {depth, width, 0.60F}, 6);
  const float seat = (width - 2 * arm) / 2;
  for (const float y : {arm, arm + seat}) {
    cushion({0.16F, y, 0.30F}, {depth + 0.02F, y + seat, 0.46F}, 5);
    cushion({0.02F, y, 0.40F}, {0.26F, y + seat, 0.86F}, 4);
  }
  room.add("sofa", std::move(cushions), {0.13F, 0.17F, 0.20F}, 1, -1, 0.05F);
  Mesh pillow = make_cushion({0.07F, 0.2F, 0.2F}, 2.6F, 5);
  Mesh pillows;
  const float cosine = std::cos(0.35F), sine = std::sin(0.35F);
  for (Vec3f& p : pillow.positions) p = {p.x * cosine - p.z * sine, p.y, p.z * cosine + p.x * sine};
  for (Vec3f& n : pillow.normals) n = {n.x * cosine - n.z * sine, n.y, n.z * cosine + n.x * sine};
  append(pillows, pillow, corner + Vec3f{0.36F, 0.42F, 0.66F}, 0.35F);
  append(pillows, pillow, corner + Vec3f{0.38F, 1.6F, 0.66F}, -0.3F);
  room.add("pillows", std::move(pillows), {0.46F, 0.16F, 0.04F}, 1, -1, 0.05F);
}

void add_shelf(MadeSceneBuilder& room) {
  constexpr float x0 = right - 0.32F, y0 = 0.62F, y1 = 1.82F, top = 1.9F, thick = 0.025F;
  constexpr int boards = 5;
  Mesh shelf;
  append(shelf, make_box_faces({x0, y0, 0}, {right, y0 + thick, top}, "-x -y +y +z", 1));
  append(shelf, make_box_faces({x0, y1 - thick, 0}, {right, y1, top}, "-x -y +y +z", 1));
  constexpr float step = (top - 0.08F) / (boards - 1);
  for (int i = 0; i < boards; ++i) {
    const float z = 0.06F + step * static_cast<float>(i);
    append(shelf, make_box_faces({x0 + 0.005F, y0 + thick, z}, {right, y1 - thick, z + thick},
                                 "-x -z +z", 1));
  }
  room.add("shelf", std::move(shelf), shining("shelf", walnut, 0.4F, 0, 0.3F));
  constexpr std::array<Base, 5> covers{{{0.25F, 0.03F, 0.03F},
                                        {0.03F, 0.08F, 0.2F},
                                        {0.4F, 0.32F, 0.18F},
                                        {0.05F, 0.14F, 0.07F},
                                        {0.08F, 0.07F, 0.07F}}};
  std::array<Mesh, covers.size()> books;
  for (int i = 0; i < boards - 1; ++i) {
    const float z = 0.06F + step * static_cast<float>(i) + thick;
    float y = y0 + thick + 0.02F + 0.04F * static_cast<float>((i * 7) % 4);
    for (int k = 0; y < y1 - 0.18F - 0.09F * static_cast<float>((i * 5) % 4); ++k) {
      const auto pick = static_cast<float>((i * 31 + k * 17) % 11) / 11;
      const float thickness = 0.022F + 0.03F * pick;
      const float high = 0.23F + 0.12F * static_cast<float>((i * 13 + k * 29) % 7) / 7;
      const float x = x0 + 0.03F + 0.05F * pick;
      append(books[static_cast<std::size_t>((i * 3 + k * 7 + k / 3) % 5)],
             make_box_faces({x, y, z}, {right - 0.03F, y + thickness, z + high}, "-x -y +y +z", 1));
      y += thickness + 0.003F;
    }
  }
  for (std::size_t i = 0; i < covers.size(); ++i)
    room.add("books " + std::to_string(i + 1), std::move(books[i]), covers[i], 0.8F, -1, 0.1F);
  const Profile bowl{{0.05F, 0},     {0.055F, 0.012F}, {0.1F, 0.05F},  {0.13F, 0.1F}, {0.13F, 0.1F},
                     {0.126F, 0.1F}, {0.126F, 0.1F},   {0.09F, 0.05F}, {0, 0.02F}};
  Mesh turned;
  append(turned, make_turned(bowl, 35), {right - 0.17F, 1.0F, top + 0.065F});
  room.add("bowl", std::move(turned), shining("bowl", {0.05F, 0.25F, 0.3F}, 0.1F, 0, 1));
}

void add_pictures(MadeSceneBuilder& room) {
  constexpr float frame = 0.045F, deep = 0.025F;
  // A mirror over the sofa.
  constexpr float y0 = -1.05F, y1 = 0.25F, z0 = 1.08F, z1 = 1.95F;
  room.add("mirror", make_rectangle({left + 0.008F, y0, z0}, {0, y1 - y0, 0}, {0, 0, z1 - z0}, 0),
           shining("mirror", {0.92F, 0.93F, 0.93F}, 0, 1, 0));
  Mesh rim;
  const auto bar = [&](float ya, float za, float yb, float zb, std::string_view faces) {
    append(rim, make_box_faces({left, ya, za}, {left + deep, yb, zb}, faces, 1));
  };
  bar(y0 - frame, z0 - frame, y0, z1 + frame, "+x -y +y -z +z");
  bar(y1, z0 - frame, y1 + frame, z1 + frame, "+x -y +y -z +z");
  bar(y0, z0 - frame, y1, z0, "+x -z +z");
  bar(y0, z1, y1, z1 + frame, "+x -z +z");
  room.add("mirror frame", std::move(rim), shining("mirror frame", {0.85F, 0.62F, 0.28F}, 0, 1, 0));
  const auto painting = room.add(make_court_texture(128, 9));
  const auto sea = room.add(make_lawn_texture(128, 3));
  int number = 0;
  for (const auto& [x, texture] : {std::pair{-1.02F, painting}, std::pair{1.28F, sea}}) {
    const std::string name = "picture " + std::to_string(++number);
    room.add(name, make_rectangle({x - 0.2F, back - 0.012F, 1.35F}, {0.4F, 0, 0}, {0, 0, 0.52F}, 0),
             white, 0.8F, texture, 0.1F);
    Mesh frames;
    const auto post = [&](float xa, float za, float xb, float zb, std::string_view faces) {
      append(frames, make_box_faces({xa, back - deep, za}, {xb, back, zb}, faces, 1));
    };
    post(x - 0.23F, 1.32F, x - 0.2F, 1.90F, "-x +x -y -z +z");
    post(x + 0.2F, 1.32F, x + 0.23F, 1.90F, "-x +x -y -z +z");
    post(x - 0.2F, 1.32F, x + 0.2F, 1.35F, "-y -z +z");
    post(x - 0.2F, 1.87F, x + 0.2F, 1.90F, "-y -z +z");
    room.add(name + " frame", std::move(frames), {0.03F, 0.025F, 0.02F}, 0.8F, -1, 0.1F);
  }
}

void add_lamp(MadeSceneBuilder& room, bool on) {
  const Profile stand{{0.15F, 0},      {0.15F, 0.018F}, {0.15F, 0.018F},
                      {0.012F, 0.03F}, {0.012F, 0.03F}, {0.012F, 1.42F}};
  Mesh pole;
  append(pole, make_turned(stand, 24), lamp_foot);
  room.add("lamp", std::move(pole), shining("lamp", {0.6F, 0.5F, 0.3F}, 0, 1, 0));
  const Profile shade{{0.23F, 1.34F}, {0.16F, 1.70F}};
  Mesh cloth;
  append(cloth, make_turned(shade, 41), lamp_foot);
  const Base glow{0.85F, 0.55F, 0.26F};
  room.add("lamp shade", std::move(cloth),
           glowing("lamp shade", {0.6F, 0.5F, 0.35F}, on ? glow : Base{}));
}

void add_plant(MadeSceneBuilder& room) {
  constexpr Vec3f foot{1.55F, 1.72F, 0};
  const Profile pot{{0.11F, 0},      {0.16F, 0.27F},  {0.16F, 0.27F},  {0.175F, 0.27F},
                    {0.175F, 0.27F}, {0.175F, 0.31F}, {0.175F, 0.31F}, {0.155F, 0.31F},
                    {0.155F, 0.31F}, {0.15F, 0.27F}};
  Mesh turned;
  append(turned, make_turned(pot, 28), foot);
  room.add("pot", std::move(turned), {0.42F, 0.15F, 0.07F}, 0.9F, -1, 0.1F);
  const Profile soil{{0.151F, 0.28F}, {0, 0.285F}};
  Mesh earth;
  append(earth, make_turned(soil, 28), foot);
  room.add("earth", std::move(earth), {0.03F, 0.02F, 0.015F}, 1, -1, 0.1F);
  Mesh leaves;
  constexpr int count = 15, rows = 9, columns = 3;
  for (int i = 0; i < count; ++i) {
    const auto share = static_cast<float>(i) / count;
    const float high = 0.55F + 0.45F * (1 - share), reach = 0.22F + 0.36F * share;
    std::vector<Vec3f> points;
    for (int row = 0; row < rows; ++row) {
      const float t = static_cast<float>(row) / (rows - 1);
      const float half =
          0.055F * std::pow(std::sin(std::numbers::pi_v<float> * (0.06F + 0.92F * t)), 0.8F);
      const float x = 0.03F + reach * std::pow(t, 1.6F);
      const float z = 0.28F + high * std::sin(1.9F * t) * (1 - 0.1F * t);
      for (int column = -1; column <= 1; ++column) {
        const auto side = static_cast<float>(column);
        points.push_back({x, side * half, z + 0.3F * half * side * side});
      }
    }
    append(leaves, make_sheet(points, rows, columns), foot,
           static_cast<float>(i) * std::numbers::pi_v<float> * (3 - std::sqrt(5.0F)));
  }
  room.add("leaves", std::move(leaves), {0.07F, 0.22F, 0.05F}, 0.7F, -1, 0.1F);
}

}  // namespace

SceneDescription make_tv_room(bool lamp_on) {
  MadeSceneBuilder room;
  add_room(room);
  add_television(room);
  add_lowboard(room);
  add_table(room);
  add_sofa(room);
  add_shelf(room);
  add_pictures(room);
  add_lamp(room, lamp_on);
  add_plant(room);
  SceneDescription scene = room.take();
  const std::size_t made = triangle_count(scene);
  if (made != made_tv_room_triangles) {
    throw std::logic_error("the made TV room has " + std::to_string(made) + " triangles");
  }
  return scene;
}

std::vector<LocalLight> lights_of_tv_room() {
  return {{lamp_foot + Vec3f{0, 0, 1.52F}, {}, {0.8F, 0.52F, 0.25F}}};
}

}  // namespace render
