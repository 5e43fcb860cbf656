// Quantiles of a stream of durations, in fixed memory.
#pragma once

#include <array>
#include <cstdint>

namespace studio {

// Counts values in bins 1 % wide from 1 microsecond to 1000 seconds, so a quantile is right to 0.5
// %.
class Quantiles {
 public:
  void add(double milliseconds);
  std::int64_t count() const { return count_; }
  // The smallest value that at least `share` (0 to 1) of all do not exceed: by nearest rank, so
  // that .99 of fewer than 100 is the largest. 0 if there are none.
  double at(double share) const;
  double mean() const { return count_ > 0 ? sum_ / static_cast<double>(count_) : 0; }
  double largest() const { return largest_; }

 private:
  static constexpr std::size_t bins = 2084;  // log(1e9) / log(1.01), and one

  std::array<std::uint32_t, bins> bin_{};
  std::int64_t count_ = 0;
  double sum_ = 0;
  double largest_ = 0;
};

}  // namespace studio
