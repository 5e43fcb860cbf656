// How fast the kernel is, beside bare Embree over the same rays.
#pragma once

#include <cstddef>
#include <cstdint>

#include "studio/bench_scene.h"

namespace studio {

struct KernelRate {
  double kernel_ms = 0;
  double bare_ms = 0;  // the same rays, nothing but Embree, its best mode
  std::size_t rays = 0;
};

// The best of `runs`. Kernel and bare loop take turns, so that both see the same noise of the
// machine.
KernelRate measure_kernel(const BenchScene& shot, const render::FrameJob& job, int runs);

struct KeptRate {
  double ms = 0;
  std::uint64_t rays = 0;  // > 0 where the memory for kept transport does not hold all cells
};

// A frame of a still shot under light that drifts, whose transport is kept: the best of `runs`.
KeptRate measure_kept(const BenchScene& shot, const render::FrameJob& job, int runs);

// One camera ray a pixel, whose every surface tests every light that it faces, and nothing adapts.
render::Effort plain_effort(render::Effort effort);

}  // namespace studio
