// The registry of shaders.
#include "render/shader.h"

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

// Seen at a slant the cone covers a longer piece of surface that way.
Spread mirrored_spread(const ShadePoint& p, Vec3f normal, Vec3f view) {
  const float cosine = dot(normal, view);
  const Vec3f slant = normalize(view - normal * cosine);
  const Vec3f side = cross(normal, slant);
  const auto mirrored_turn = [&](Vec3f step) {
    const Vec3f turn = turn_of_normal(p.hit, step);
    return (normal * dot(turn, view) + turn * cosine) * 2;
  };
  Spread spread{mirrored_turn(slant * (p.footprint_m / std::max(cosine, 0.1F))),
                mirrored_turn(side * p.footprint_m)};
  spread.b += side * p.spread_rad;
  spread.a += normalize(cross(side, mirrored(view, normal))) * p.spread_rad;
  return spread;
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
