// The registry of shaders.
#include "render/shader.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "render/builtin_shaders.h"
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
  const auto arrived = [&](Vec3f step, Vec3f turn) {
    const Vec3f moved = step + turn * distance_m;
    return moved - p.incoming * dot(moved, p.incoming);
  };
  const Vec3f a = arrived(steps.a, turns.a), b = arrived(steps.b, turns.b);
  p.footprint_m = std::sqrt(length(a) * length(b));
  // Seen at a slant the cone covers a longer piece of surface that way.
  const Vec3f normal = p.hit.normal;
  const Vec3f along = p.incoming * (1 / std::max(-dot(normal, p.incoming), 0.1F));
  p.steps = {a + along * dot(a, normal), b + along * dot(b, normal)};
  p.turns = turns;
}

Spread mirrored_spread(const ShadePoint& p, Vec3f normal, Vec3f view) {
  const float cosine = dot(normal, view);
  const auto mirrored_turn = [&](Vec3f step, Vec3f widened) {
    const Vec3f turn = turn_of_normal(p.hit, step);
    return widened + turn * (2 * cosine) + normal * (2 * (dot(turn, view) - dot(widened, normal)));
  };
  return {mirrored_turn(p.steps.a, p.turns.a), mirrored_turn(p.steps.b, p.turns.b)};
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
