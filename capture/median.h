// Medians and quantiles.
#pragma once

#include <algorithm>
#include <cstddef>
#include <ranges>
#include <vector>

namespace capture {

// The standard deviation of a normal spread over the median of how far its values are off.
inline constexpr double sigma_by_median = 1.4826;

// Of at least one value, the upper one of two in the middle. Leaves them in another order.
template <std::ranges::random_access_range Values>
std::ranges::range_value_t<Values> median_in_place(Values&& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

// The same of values that stay as they are.
template <class T>
T median(std::vector<T> values) {
  return median_in_place(values);
}

// The value `share` of the way, from 0 to 1, through the sorted ones, rounded down: at a half, the
// lower one of two in the middle. Of at least one value; leaves them in another order.
template <class T>
T quantile_in_place(std::vector<T>& values, double share) {
  const auto place =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, place);
  return *place;
}

}  // namespace capture
