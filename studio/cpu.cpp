// The CPU check. This file is built for plain x86-64, unlike all others, so that it can run where
// they cannot; it uses nothing of the C++ library, which might have been inlined for more.
#include <unistd.h>

#include <cstring>

namespace {

constexpr char refusal[] = "platelight: this CPU lacks the instructions of " PLATELIGHT_ARCH
                           " (AVX2, FMA, BMI, F16C): use a CPU of 2013 or later, or build with "
                           "-DPLATELIGHT_ARCH=x86-64-v2\n";

bool cpu_suffices() {
  __builtin_cpu_init();
  return __builtin_cpu_supports(PLATELIGHT_ARCH) != 0;
}

// Runs before any static object of ours is made: even those may use the instructions that are
// checked for. This is the one place outside main that ends the program.
__attribute__((constructor(101))) void refuse_old_cpu() {
  if (cpu_suffices()) return;
  static_cast<void>(!write(STDERR_FILENO, refusal, std::strlen(refusal)));
  _exit(1);
}

}  // namespace
