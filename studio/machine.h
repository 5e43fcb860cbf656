// The machine that figures were measured on.
#pragma once

#include <string>

namespace studio {

struct Machine {
  std::string cpu;   // as the kernel names it; "unknown" if it does not
  int threads = 0;   // that this process may use
  std::string arch;  // that the program was built for
};

Machine this_machine();

// CPU time that the program has taken, of all threads.
double cpu_ms_so_far();

}  // namespace studio
