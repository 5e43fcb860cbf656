// Medians.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace capture {

// Of at least one value, the upper one of two in the middle. Leaves them in another order.
template <class T>
T median_in_place(std::vector<T>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace capture
