// The program.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include "studio/command.h"
#include "studio/set.h"
#include "studio/start.h"

namespace {

int fail(const std::string& why, int status) {
  std::fputs((why + "\n").c_str(), stderr);  // where that fails, the status tells
  return status;
}

}  // namespace

int main(int count, char** words) {
  try {
    studio::start();
    return studio::run_command_line(count, words);
  } catch (const studio::UsageError& error) {
    return fail(std::string("platelight: ") + error.what(), 2);
  } catch (const studio::SetError& error) {
    return fail(error.what(), 1);  // FILE:LINE:COLUMN: ..., as editors read it
  } catch (const std::filesystem::filesystem_error& error) {
    return fail("platelight: " + error.path1().string() + ": " + error.code().message(), 1);
  } catch (const std::exception& error) {
    return fail(std::string("platelight: ") + error.what(), 1);
  }
}
