// Exposure times as command lines state them.
#include "studio/commands/exposure_list.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

#include <fmt/format.h>

#include "studio/arguments.h"

namespace studio {
namespace {

double number_of(std::string_view word) {
  double number = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(number)) {
    throw UsageError(fmt::format("--exposures: \"{}\" is no time, such as 0.5 or 1/80", word));
  }
  return number;
}

}  // namespace

std::vector<double> exposures_in(std::string_view list) {
  std::vector<double> exposures_s;
  for (std::size_t begin = 0; begin < list.size();) {
    const std::size_t end = std::min(list.find(',', begin), list.size());
    const std::string_view word = list.substr(begin, end - begin);
    const std::size_t slash = word.find('/');
    const double over = slash == word.npos ? 1 : number_of(word.substr(slash + 1));
    const double exposure_s = number_of(word.substr(0, slash)) / over;
    constexpr double least_s = 1e-9, most_s = 3600;
    if (exposure_s != 0 && !(exposure_s >= least_s && exposure_s <= most_s)) {
      throw UsageError(
          fmt::format("--exposures: \"{}\" is neither 0 nor a time from 1e-9 to 3600 s", word));
    }
    exposures_s.push_back(exposure_s);
    begin = end + 1;
  }
  return exposures_s;
}

}  // namespace studio
