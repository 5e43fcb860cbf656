// v4l2: URIs, and what they choose.
#include "capture/v4l2_request.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <tuple>

#include "capture/v4l2_format.h"

namespace capture {
namespace {

constexpr PictureSize largest_unasked{1920, 1080};
constexpr double slowest_unasked = 24;  // frames a second; a little less is let pass
constexpr double rate_tolerance = 0.005;

[[noreturn]] void refuse(const std::string& why) {
  throw std::runtime_error(why +
                           "; write v4l2:/dev/video0?format=YUYV&size=640x480&rate=30 and, after "
                           "more &, controls by name (platelight devices lists all that there is)");
}

bool agree(Rational a, Rational b) { return std::abs(a.value() / b.value() - 1) <= rate_tolerance; }

// Each once, in their order.
template <class Range, class Words>
std::string list(const Range& range, const Words& words) {
  std::string all;
  std::set<std::string> said;
  for (const auto& one : range) {
    const std::string word = words(one);
    if (word.empty() || !said.insert(word).second) continue;
    all += (all.empty() ? "" : ", ") + word;
  }
  return all.empty() ? "nothing" : all;
}

// A mode at one size, and the best rate for the request.
struct Candidate {
  const PixelCoding* coding = nullptr;
  PictureSize size;
  std::optional<Rational> rate;
};

std::optional<PictureSize> size_of_mode(const V4l2Mode& mode,
                                        const std::optional<PictureSize>& wanted) {
  if (wanted) {
    return mode.has_size(wanted->width, wanted->height) ? wanted : std::nullopt;
  }
  const auto largest = [](int low, int high, int step, int most) {
    if (high <= most) return high;
    return low > most ? low : low + (most - low) / step * step;
  };
  return PictureSize{
      largest(mode.min_width, mode.max_width, mode.width_step, largest_unasked.width),
      largest(mode.min_height, mode.max_height, mode.height_step, largest_unasked.height)};
}

// Nothing: the mode has not that rate. A rate that is not told is the device's to refuse.
std::optional<std::optional<Rational>> rate_of_mode(const V4l2Mode& mode,
                                                    const std::optional<Rational>& wanted) {
  if (mode.rates.empty()) return wanted;
  if (!wanted) return mode.rates.front();
  for (const Rational rate : mode.rates) {
    if (agree(rate, *wanted)) return rate;
  }
  if (mode.rates_between && wanted->value() < mode.rates.front().value() &&
      wanted->value() > mode.rates.back().value()) {
    return wanted;
  }
  return std::nullopt;
}

// Greater is better.
auto merit(const Candidate& candidate) {
  const PictureSize size = candidate.size;
  const double rate = candidate.rate ? candidate.rate->value() : slowest_unasked;
  const bool fits = size.width <= largest_unasked.width && size.height <= largest_unasked.height;
  const bool fast = rate >= slowest_unasked * (1 - rate_tolerance);
  const std::int64_t area = std::int64_t{size.width} * size.height;
  return std::tuple(fast, fast ? 0.0 : rate, fits, fits ? area : -area,
                    -(candidate.coding - pixel_codings().data()), rate);
}

// A mode's format, and sizes: for people.
std::string name_in(const V4l2Mode& mode) { return name_of_fourcc(mode.fourcc); }

[[noreturn]] void refuse_format(const V4l2Device& device, const V4l2Request& request) {
  const auto readable = [](const V4l2Mode& mode) {
    return coding_of(mode.fourcc) != nullptr ? name_in(mode) : std::string();
  };
  if (!request.fourcc) {
    throw std::runtime_error("it has " + list(device.modes, name_in) +
                             ", and none of it can be read");
  }
  const std::string name = name_of_fourcc(*request.fourcc);
  if (coding_of(*request.fourcc) == nullptr) {
    throw std::runtime_error("format " + name +
                             " was asked for, which is not read; of what it has, " +
                             list(device.modes, readable) + " can be");
  }
  throw std::runtime_error("format " + name + " was asked for; it has " +
                           list(device.modes, name_in));
}

}  // namespace

V4l2Request parse_v4l2(std::string_view rest) {
  CameraSettings parsed;
  try {
    parsed = parse_settings(rest);
  } catch (const std::runtime_error& error) {
    refuse(error.what());
  }
  V4l2Request request;
  request.device = parsed.device;
  if (request.device.empty()) refuse("no device is named");
  for (const auto& [key, value] : parsed.settings) {
    if (key == "format") {
      request.fourcc = fourcc_of_name(value);
      if (!request.fourcc) refuse("format=" + value + " is no format");
    } else if (key == "size") {
      request.size = size_in(value);
      if (!request.size) refuse("size=" + value + " is no size");
    } else if (key == "rate") {
      request.rate = rate_in(value);
      if (!request.rate) refuse("rate=" + value + " is no rate in frames a second");
    } else if (const auto whole = number_in<std::int64_t>(value)) {
      request.controls.emplace_back(key, *whole);
    } else {
      refuse("the control " + key + " takes a whole number, not \"" + value + "\"");
    }
  }
  return request;
}

V4l2Choice choose_mode(const V4l2Device& device, const V4l2Request& request) {
  std::vector<const V4l2Mode*> of_format;
  for (const V4l2Mode& mode : device.modes) {
    const bool wanted = !request.fourcc || mode.fourcc == *request.fourcc;
    if (wanted && coding_of(mode.fourcc) != nullptr) of_format.push_back(&mode);
  }
  if (of_format.empty()) refuse_format(device, request);
  std::vector<const V4l2Mode*> of_size;
  std::vector<Candidate> candidates;
  for (const V4l2Mode* mode : of_format) {
    const auto size = size_of_mode(*mode, request.size);
    if (!size) continue;
    of_size.push_back(mode);
    if (const auto rate = rate_of_mode(*mode, request.rate)) {
      candidates.push_back({coding_of(mode->fourcc), *size, *rate});
    }
  }
  const auto with_size = [](const V4l2Mode* mode) {
    return name_in(*mode) + " " + sizes_of(*mode);
  };
  if (of_size.empty()) {
    throw std::runtime_error("size " + words_of(*request.size) + " was asked for; it has " +
                             list(of_format, with_size));
  }
  if (candidates.empty()) {
    throw std::runtime_error("rate " + words_of(*request.rate) + " was asked for; it has " +
                             list(of_size, [&](const V4l2Mode* mode) {
                               return with_size(mode) + " at " + rates_of(*mode);
                             }));
  }
  const auto best = std::ranges::max_element(candidates, {}, merit);
  return {best->coding->fourcc, best->size, best->rate};
}

const V4l2Control& control_for(const V4l2Device& device,
                               const std::string& name,
                               std::int64_t value) {
  const auto control = std::ranges::find(device.controls, name, &V4l2Control::name);
  const std::string asked = name + "=" + std::to_string(value) + " was asked for; ";
  if (control == device.controls.end()) {
    throw std::runtime_error(asked + "its controls are " +
                             list(device.controls, [](const V4l2Control& c) { return c.name; }));
  }
  if (!control->settable) throw std::runtime_error(asked + "that control can only be read");
  if (value < control->low || value > control->high) {
    throw std::runtime_error(asked + "it can be " + std::to_string(control->low) + " to " +
                             std::to_string(control->high));
  }
  if (control->inactive) {
    throw std::runtime_error(asked +
                             "it has no effect while another control is automatic: set that one to "
                             "manual before it (for exposure_time_absolute: auto_exposure=1)");
  }
  return *control;
}

std::string sizes_of(const V4l2Mode& mode) {
  const std::string largest = words_of(PictureSize{mode.max_width, mode.max_height});
  const std::string smallest = words_of(PictureSize{mode.min_width, mode.min_height});
  return smallest == largest ? largest : smallest + " to " + largest;
}

std::string rates_of(const V4l2Mode& mode) {
  if (mode.rates.empty()) return "a rate that it does not tell";
  if (mode.rates_between) {
    return words_of(mode.rates.back()) + " to " + words_of(mode.rates.front()) + "/s";
  }
  return list(mode.rates, [](Rational rate) { return words_of(rate); }) + "/s";
}

}  // namespace capture
