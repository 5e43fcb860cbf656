// Quantiles by logarithmic bins.
#include "studio/quantiles.h"

#include <algorithm>
#include <cmath>

namespace studio {
namespace {

constexpr double smallest_ms = 1e-3;
constexpr double step = 1.01;

}  // namespace

void Quantiles::add(double milliseconds) {
  const double place = std::log(std::max(milliseconds, smallest_ms) / smallest_ms) / std::log(step);
  ++bin_[std::min(bins - 1, static_cast<std::size_t>(place))];
  ++count_;
  sum_ += milliseconds;
  largest_ = std::max(largest_, milliseconds);
}

double Quantiles::at(double share) const {
  if (count_ == 0) return 0;
  constexpr double rounding = 1e-9;  // .07 * 100 is a little more than 7
  const double rank =
      std::ceil(std::clamp(share, 0.0, 1.0) * static_cast<double>(count_) - rounding);
  double passed = 0;
  for (std::size_t i = 0; i < bins; ++i) {
    passed += bin_[i];
    if (passed >= std::max(rank, 1.0)) {
      const double middle = smallest_ms * std::pow(step, static_cast<double>(i) + 0.5);
      return std::min(middle, largest_);
    }
  }
  return largest_;
}

}  // namespace studio
