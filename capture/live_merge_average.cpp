// The average of stretches, for the instruction set that the program is built for, and for AVX-512
// where the machine has it. Both give the same bits.
#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "capture/live_merge_plan.h"

namespace capture::window_merge {

// The compiler tells its target before it reads what changes that, so it is told here.
#if defined(__AVX512F__) && defined(__AVX512BW__) && defined(__AVX512DQ__)
#define PLATELIGHT_REGISTER_BYTES 64
#elif defined(__AVX2__) && defined(__FMA__)
#define PLATELIGHT_REGISTER_BYTES 32
#else
#define PLATELIGHT_REGISTER_BYTES 16
#endif
namespace built {
namespace {
#include "capture/live_merge_average.inc"
}  // namespace
}  // namespace built

#if PLATELIGHT_REGISTER_BYTES == 32 && !defined(__clang__)
#define PLATELIGHT_WIDE_MERGE
#undef PLATELIGHT_REGISTER_BYTES
#define PLATELIGHT_REGISTER_BYTES 64
#pragma GCC push_options
#pragma GCC target("arch=x86-64-v4")
namespace wide {
namespace {
#include "capture/live_merge_average.inc"
}  // namespace
}  // namespace wide
#pragma GCC pop_options
#endif

template <class Code>
Kernel<Code> built_kernel() {
  return {built::average_all<Code>, built::find_contradictions<Code>};
}

template <class Code>
Kernel<Code> best_kernel() {
#ifdef PLATELIGHT_WIDE_MERGE
  static const bool has_wide = __builtin_cpu_supports("x86-64-v4") != 0;
  if (has_wide) return {wide::average_all<Code>, wide::find_contradictions<Code>};
#endif
  return built_kernel<Code>();
}

template Kernel<std::uint8_t> built_kernel();
template Kernel<std::uint16_t> built_kernel();
template Kernel<float> built_kernel();
template Kernel<std::uint8_t> best_kernel();
template Kernel<std::uint16_t> best_kernel();
template Kernel<float> best_kernel();

}  // namespace capture::window_merge
