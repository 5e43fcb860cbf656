// The command line of one command, without the library that parses it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace studio {

// Wrong usage: main prints it and returns 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// What a command declares. Targets must live until the command has run. A target keeps its value if
// its option is not given.
class Arguments {
 public:
  explicit Arguments(CLI::App& app) : app_(&app) {}

  // Required, in order: "SET", "the set file".
  void positional(const std::string& name, std::string& target, const std::string& help);
  // May be left out; the only positional.
  void optional_positional(const std::string& name, std::string& target, const std::string& help);
  // One or more; the last positional.
  void positionals(const std::string& name,
                   std::vector<std::string>& target,
                   const std::string& help);
  // "--frames" or "-o,--out".
  void option(const std::string& names, std::string& target, const std::string& help);
  void option(const std::string& names,
              std::optional<std::int64_t>& target,
              std::int64_t low,
              std::int64_t high,
              const std::string& help);
  void option(const std::string& names,
              std::optional<double>& target,
              double low,
              double high,
              const std::string& help);
  // Words joined by commas, each one of `choices`.
  void choices(const std::string& names,
               std::vector<std::string>& target,
               const std::vector<std::string>& choices,
               const std::string& help);
  // One of `choices`.
  void choice(const std::string& names,
              std::string& target,
              const std::vector<std::string>& choices,
              const std::string& help);
  // One value each time it is given.
  void repeated(const std::string& names,
                std::vector<std::string>& target,
                const std::string& help);
  void flag(const std::string& names, bool& target, const std::string& help);
  void required(const std::string& name);

 private:
  CLI::App* app_;
};

}  // namespace studio
