// The table of commands, and how a command line picks one.
#include "studio/command.h"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <memory>
#include <optional>
#include <stdexcept>
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

std::string joined(const std::vector<std::string>& words, char between) {
  std::string all;
  for (const std::string& word : words) {
    if (!all.empty()) all += between;
    all += word;
  }
  return all;
}

// Where choices of a list were given as words of their own, which CLI11 takes for positionals or
// does not expect: what to write instead. Else "".
std::string spaced_choices(CLI::App& app) {
  std::vector<std::string> words;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_positional()) std::ranges::copy(option->results(), std::back_inserter(words));
  }
  std::ranges::copy(app.remaining(), std::back_inserter(words));
  for (CLI::Option* option : app.get_options()) {
    if (option->get_delimiter() != ',' || option->empty()) continue;
    const CLI::Validator& refuse = *option->get_validator();
    std::vector<std::string> meant;
    std::ranges::copy_if(words, std::back_inserter(meant),
                         [&](const std::string& word) { return refuse(word).empty(); });
    if (meant.empty()) continue;
    return fmt::format("\"{}\" was not expected: write {} {},{}", joined(meant, ' '),
                       option->get_name(), joined(option->results(), ','), joined(meant, ','));
  }
  return "";
}

int report_usage(CLI::App& app, const CLI::ParseError& error) {
  CLI::App* used = &app;
  std::string name = "platelight";
  while (!used->get_subcommands().empty()) {
    used = used->get_subcommands().back();
    name += " " + used->get_name();
  }
  const bool has_extras = error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ExtrasError);
  std::string reason = has_extras ? spaced_choices(*used) : "";
  if (reason.empty()) reason = error.what();
  std::ranges::replace(reason, '\n', ' ');
  fmt::print(stderr, "{}: {} (see {} --help)\n", name, reason, name);
  return 2;
}

// The place of a command in the tree: "calibrate response" is under "calibrate".
CLI::App* add_command(CLI::App& app, const Command& command) {
  const std::string name(command.name);
  const std::size_t space = name.find(' ');
  if (space == std::string::npos) return app.add_subcommand(name, std::string(command.summary));
  const std::string group_name = name.substr(0, space);
  const std::vector<CLI::App*> known =
      app.get_subcommands([&](const CLI::App* sub) { return sub->get_name() == group_name; });
  CLI::App* group = known.empty() ? nullptr : known.front();
  if (group == nullptr) {
    group = app.add_subcommand(group_name, std::string(command.group_summary));
    group->require_subcommand(1);
  }
  return group->add_subcommand(name.substr(space + 1), std::string(command.summary));
}

bool begins_with(const Command& command, std::string_view words) {
  const std::string_view name = command.name;
  return name.starts_with(words) && (name.size() == words.size() || name[words.size()] == ' ');
}

// What of the command's name is given, and no command's: CLI11 would only say that one is missing.
std::optional<std::string> unknown_command(int count, const char* const* words) {
  std::string name;
  for (int i = 1; i < count && words[i][0] != '-'; ++i) {
    name += (i > 1 ? " " : "") + std::string(words[i]);
    const auto is_it = [&](const Command& command) { return command.name == name; };
    const auto may_be = [&](const Command& command) { return begins_with(command, name); };
    if (std::ranges::any_of(commands(), is_it)) return std::nullopt;
    if (std::ranges::none_of(commands(), may_be)) return name;
  }
  return std::nullopt;
}

}  // namespace

std::span<const Command> commands() {
  static const std::vector<Command> all{
      run_command(),
      check_command(),
      still_command(),
      hdr_command(),
      capture_command(),
      key_command(),
      demo_command(),
      chart_command(),
      bench_command(),
      devices_command(),
      calibrate_response_command(),
      calibrate_rig_command(),
      calibrate_vignetting_command(),
      calibrate_board_command(),
      calibrate_lens_command(),
      calibrate_lines_command(),
      calibrate_pose_command(),
      calibrate_probe_command(),
      calibrate_offset_command(),
      calibrate_light_command(),
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
    CLI::App* sub = add_command(app, command);
    Arguments arguments(*sub);
    auto run = command.declare(arguments);
    arguments.option("--json", figures_file, "write the figures to this file");
    arguments.flag("--quiet", quiet, "say nothing but what goes wrong");
    sub->footer(fmt::format("\nExample:\n  {}\n", command.example));
    declared.push_back({sub, std::move(run)});
  }

  if (const auto unknown = unknown_command(count, words)) {
    fmt::print(stderr, "platelight: there is no command \"{}\" (see platelight --help)\n",
               *unknown);
    return 2;
  }
  try {
    app.parse(count, words);
  } catch (const CLI::Success& asked) {
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    return report_usage(app, error);
  }
  // Not after an hour's work.
  if (!figures_file.empty()) require_figures_file(figures_file);
  Console console(quiet, figures_file);
  const auto chosen =
      std::ranges::find_if(declared, [](const Declared& d) { return d.app->parsed(); });
  chosen->run(console);
  if (console.lost_words()) throw std::runtime_error("standard output could not be written");
  return 0;
}

}  // namespace studio
