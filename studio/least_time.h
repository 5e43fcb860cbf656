// The least time of several runs.
#pragma once

#include <algorithm>
#include <chrono>

namespace studio {

template <class Work>
double least_time_ms(Work&& work, int runs) {
  double least = 0;
  for (int i = 0; i < runs; ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - start;
    least = i == 0 ? taken.count() : std::min(least, taken.count());
  }
  return least;
}

}  // namespace studio
