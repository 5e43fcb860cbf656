// platelight check: names every fault of a set file.
#include <memory>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "studio/commands/commands.h"
#include "studio/set.h"

namespace studio {
namespace {

nlohmann::ordered_json to_json(const std::vector<Diagnostic>& diagnostics) {
  auto list = nlohmann::ordered_json::array();
  for (const Diagnostic& d : diagnostics) {
    list.push_back(
        {{"file", d.file}, {"line", d.line}, {"column", d.column}, {"message", d.message}});
  }
  return list;
}

void check(const std::string& path, Console& console) {
  try {
    const Set set = read_set(path);
    console.figures(nlohmann::ordered_json{{"diagnostics", nlohmann::json::array()}}.dump(2));
    console.say(fmt::format("{}: good ({} objects, {} stand-ins)", path, set.objects.size(),
                            set.stand_ins.size()));
  } catch (const SetError& error) {
    console.figures(nlohmann::ordered_json{{"diagnostics", to_json(error.diagnostics())}}.dump(2));
    throw;
  }
}

}  // namespace

Command check_command() {
  return {"check", "Check a set file and name all its faults",
          "platelight check studio/sets/desk_car.toml",
          [](Arguments& arguments) -> std::function<void(Console&)> {
            auto path = std::make_shared<std::string>();
            arguments.positional("SET", *path, "set file");
            return [path](Console& console) { check(*path, console); };
          }};
}

}  // namespace studio
