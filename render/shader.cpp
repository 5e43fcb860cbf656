// The registry of shaders.
#include "render/shader.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "render/builtin_shaders.h"
#include "render/ray_differential.h"
#include "render/standard.h"

namespace render {
namespace {

template <class T>
using Table = std::map<std::string, std::shared_ptr<const T>, std::less<>>;

Table<Shader>& shaders() {
  static Table<Shader> table{{"standard", make_standard_shader()}, {"glass", make_glass_shader()}};
  return table;
}

Table<BackgroundShader>& backgrounds() {
  static Table<BackgroundShader> table{{"environment", make_environment_background()}};
  return table;
}

template <class T>
std::shared_ptr<const T> find(const Table<T>& table, std::string_view name, const char* what) {
  const auto found = table.find(name);
  if (found != table.end()) return found->second;
  std::string known;
  for (const auto& [key, value] : table) known += (known.empty() ? "" : ", ") + key;
  throw std::invalid_argument("no " + std::string(what) + " is called \"" + std::string(name) +
                              "\"; there are: " + known);
}

}  // namespace

void arrive(ShadePoint& p, const Spread& steps, const Spread& turns, float distance_m) {
  const auto across = [&](Vec3f step, Vec3f turn) {
    const Vec3f moved = step + turn * distance_m;
    return moved - p.incoming * dot(moved, p.incoming);
  };
  p.footprint_m = std::sqrt(length(across(steps.a, turns.a)) * length(across(steps.b, turns.b)));
  // Seen at a slant the cone covers a longer piece of surface that way.
  constexpr float flattest = 0.1F;
  p.steps = {arrived({steps.a, turns.a}, p.hit, p.incoming, distance_m, flattest).step,
             arrived({steps.b, turns.b}, p.hit, p.incoming, distance_m, flattest).step};
  p.turns = turns;
}

Spread mirrored_spread(const ShadePoint& p, Vec3f normal, Vec3f view) {
  return {mirrored_turn(p.hit, normal, -view, {p.steps.a, p.turns.a}),
          mirrored_turn(p.hit, normal, -view, {p.steps.b, p.turns.b})};
}

void register_shader(std::string name, std::shared_ptr<const Shader> shader) {
  shaders()[std::move(name)] = std::move(shader);
}
void register_background(std::string name, std::shared_ptr<const BackgroundShader> shader) {
  backgrounds()[std::move(name)] = std::move(shader);
}
std::shared_ptr<const Shader> find_shader(std::string_view name) {
  return find(shaders(), name, "shader");
}
std::shared_ptr<const BackgroundShader> find_background(std::string_view name) {
  return find(backgrounds(), name, "background");
}

}  // namespace render
