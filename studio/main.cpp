// The program.
#include <cstdio>
#include <exception>

#include <fmt/format.h>

#include "studio/command.h"
#include "studio/set.h"

int main(int count, char** words) {
  try {
    return studio::run_command_line(count, words);
  } catch (const studio::SetError& error) {
    fmt::print(stderr, "{}\n", error.what());  // FILE:LINE:COLUMN: ..., as editors read it
    return 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "platelight: {}\n", error.what());
    return 1;
  }
}
