// The registry of shaders.
#include "render/shader.h"

#include <map>
#include <stdexcept>

#include "render/builtin_shaders.h"

namespace render {
namespace {

template <class T>
using Table = std::map<std::string, std::shared_ptr<const T>, std::less<>>;

Table<Shader>& shaders() {
  static Table<Shader> table{{"standard", make_standard_shader()}};
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
