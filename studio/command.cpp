// The table of commands, and how a command line picks one.
#include "studio/command.h"

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "studio/commands/commands.h"

namespace studio {
namespace {

// A command with the options that it declared, ready to run.
struct Declared {
  CLI::App* app = nullptr;
  std::function<void(Console&)> run;
};

int report_usage(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App* used = &app;
  for (const CLI::App* chosen : app.get_subcommands()) used = chosen;
  const std::string name = used == &app ? "platelight" : "platelight " + used->get_name();
  std::string reason = error.what();
  std::ranges::replace(reason, '\n', ' ');
  fmt::print(stderr, "{}: {} (see {} --help)\n", name, reason, name);
  return 2;
}

}  // namespace

std::span<const Command> commands() {
  static const std::vector<Command> all{
      run_command(),  check_command(), still_command(), hdr_command(),     capture_command(),
      demo_command(), chart_command(), bench_command(), devices_command(),
  };
  return all;
}

int run_command_line(int count, const char* const* words) {
  CLI::App app("Augmented-reality compositing: virtual objects in real pictures, in real light.",
               "platelight");
  app.set_version_flag("--version", PLATELIGHT_VERSION);
  app.require_subcommand(1);
  app.footer("\nEvery command has --help with an example.\n");

  bool quiet = false;
  std::string figures_file;
  std::vector<Declared> declared;
  for (const Command& command : commands()) {
    CLI::App* sub = app.add_subcommand(std::string(command.name), std::string(command.summary));
    Arguments arguments(*sub);
    auto run = command.declare(arguments);
    arguments.option("--json", figures_file, "write the figures to this file");
    arguments.flag("--quiet", quiet, "say nothing but what goes wrong");
    sub->footer(fmt::format("\nExample:\n  {}\n", command.example));
    declared.push_back({sub, std::move(run)});
  }

  // CLI11 would only say that a command is missing.
  if (count > 1 && words[1][0] != '-' &&
      std::ranges::find(commands(), words[1], &Command::name) == commands().end()) {
    fmt::print(stderr, "platelight: there is no command \"{}\" (see platelight --help)\n",
               words[1]);
    return 2;
  }
  try {
    app.parse(count, words);
  } catch (const CLI::Success& asked) {
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    return report_usage(app, error);
  }
  Console console(quiet, figures_file);
  const auto chosen =
      std::ranges::find_if(declared, [](const Declared& d) { return d.app->parsed(); });
  chosen->run(console);
  return 0;
}

}  // namespace studio
