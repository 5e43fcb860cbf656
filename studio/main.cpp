// The program.
#include <cstdio>
#include <exception>

#include <fmt/format.h>

#include "studio/command.h"
#include "studio/set.h"
#include "studio/start.h"

int main(int count, char** words) {
  try {
    studio::start();
    return studio::run_command_line(count, words);
  } catch (const studio::UsageError& error) {
    fmt::print(stderr, "platelight: {}\n", error.what());
    return 2;
  } catch (const studio::SetError& error) {
    fmt::print(stderr, "{}\n", error.what());  // FILE:LINE:COLUMN: ..., as editors read it
    return 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "platelight: {}\n", error.what());
    return 1;
  }
}
