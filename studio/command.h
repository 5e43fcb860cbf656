// The program's commands. Each lives in a file of its own under studio/commands and is listed once,
// in command.cpp.
#pragma once

#include <functional>
#include <span>
#include <string_view>

#include "studio/arguments.h"
#include "studio/console.h"

namespace studio {

struct Command {
  std::string_view name;  // "hdr"; or two words, a group's and its own: "calibrate response"
  std::string_view summary;
  std::string_view example;  // a whole command line
  // Declares the options and returns what runs with them. What runs throws std::runtime_error when
  // it fails, UsageError when the options do not go together.
  std::function<void(Console&)> (*declare)(Arguments& arguments);
  std::string_view group_summary = {};  // of the group, if there is one
};

std::span<const Command> commands();

// Parses and runs a command line (without the program's name). Returns the exit status: 0 done,
// 2 wrong usage (one line on stderr). A command's own exceptions pass through.
int run_command_line(int count, const char* const* words);

}  // namespace studio
