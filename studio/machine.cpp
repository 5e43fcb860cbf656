// Machines by /proc.
#include "studio/machine.h"

#include <sched.h>

#include <algorithm>
#include <ctime>
#include <fstream>

namespace studio {

Machine this_machine() {
  Machine machine{"unknown", 0, PLATELIGHT_ARCH};
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.starts_with("model name")) {
      machine.cpu = line.substr(std::min(line.size(), line.find(':') + 2));
      break;
    }
  }
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  if (sched_getaffinity(0, sizeof allowed, &allowed) == 0) machine.threads = CPU_COUNT(&allowed);
  return machine;
}

double cpu_ms_so_far() {
  std::timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

}  // namespace studio
