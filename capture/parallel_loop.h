// Loops over all cores whose beginning and end thread checkers can see. Includes TBB: for .cpp
// files.
#pragma once

#include <atomic>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

namespace capture {

// TBB orders what comes before a loop, its body on any thread, and what comes after; but its
// library is not built for ThreadSanitizer, which sees nothing of that and reports races that there
// are none of. These say it again: a few nanoseconds for each call of the body.
class LoopFence {
 public:
  void enter() const { static_cast<void>(passed_.load(std::memory_order_acquire)); }
  void leave() { passed_.fetch_add(1, std::memory_order_release); }

 private:
  std::atomic<unsigned> passed_{0};
};

// As tbb::parallel_for, of a range or from an index up to another.
template <class Value, class Body, class... Partitioner>
void parallel_for(const tbb::blocked_range<Value>& range,
                  const Body& body,
                  Partitioner&&... partitioner) {
  LoopFence fence;
  fence.leave();
  tbb::parallel_for(
      range,
      [&](const tbb::blocked_range<Value>& part) {
        fence.enter();
        body(part);
        fence.leave();
      },
      std::forward<Partitioner>(partitioner)...);
  fence.enter();
}

template <class Index, class Body, class... Partitioner>
void parallel_for(Index first, Index last, const Body& body, Partitioner&&... partitioner) {
  LoopFence fence;
  fence.leave();
  tbb::parallel_for(
      first, last,
      [&](Index i) {
        fence.enter();
        body(i);
        fence.leave();
      },
      std::forward<Partitioner>(partitioner)...);
  fence.enter();
}

// As tbb::parallel_reduce.
template <class Value, class Sum, class Body, class Join>
Sum parallel_reduce(const tbb::blocked_range<Value>& range,
                    const Sum& none,
                    const Body& body,
                    const Join& join) {
  LoopFence fence;
  fence.leave();
  Sum sum = tbb::parallel_reduce(
      range, none,
      [&](const tbb::blocked_range<Value>& part, const Sum& before) {
        fence.enter();
        Sum after = body(part, before);
        fence.leave();
        return after;
      },
      [&](const Sum& a, const Sum& b) {
        fence.enter();
        Sum both = join(a, b);
        fence.leave();
        return both;
      });
  fence.enter();
  return sum;
}

}  // namespace capture
