// Commands that measure cameras, run in a folder of the test's own.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "tests/studio/command_line.h"

namespace studio {

class CalibrateCommands : public CommandLine {
 protected:
  nlohmann::json figures() const {
    return nlohmann::json::parse(content_of(dir_ / "figures.json"));
  }
  std::string path(const std::string& name) const { return (dir_ / name).string(); }
  Outcome run_with_figures(const std::string& words) const {
    return run(words + " --json " + path("figures.json"));
  }
};

}  // namespace studio
