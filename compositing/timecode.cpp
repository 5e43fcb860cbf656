// SMPTE timecode: hours, minutes, seconds and frames of a take, with drop-frame counting.
#include "compositing/timecode.h"

#include <array>
#include <cstdio>
#include <stdexcept>

namespace compositing {
namespace {

constexpr int most_frames_a_second = 99;  // two digits

std::int64_t rounded(capture::Rational rate) {
  const std::int64_t rest = rate.num % rate.den;
  return rate.num / rate.den + (rest >= rate.den - rest ? 1 : 0);
}

// Labels left out at the start of each minute that is not a tenth one.
int dropped_per_minute(int base) { return base / 15; }

std::string rate_text(capture::Rational rate) {
  return std::to_string(rate.num) + "/" + std::to_string(rate.den) + " frames per second";
}

void require_drop_frame(capture::Rational rate) {
  if (!allows_drop_frame(rate)) {
    throw std::invalid_argument(
        "drop-frame timecode exists at 30000/1001 and 60000/1001 only, not at " + rate_text(rate));
  }
}

std::int64_t frames_per_ten_minutes(int base, bool drop_frame) {
  return std::int64_t{base} * 600 - (drop_frame ? 9 * dropped_per_minute(base) : 0);
}

}  // namespace

int timecode_base(capture::Rational rate) {
  if (rate.num <= 0 || rate.den <= 0) {
    throw std::invalid_argument("a frame rate must be positive, not " + rate_text(rate));
  }
  const std::int64_t base = rounded(rate);
  if (base < 1 || base > most_frames_a_second) {
    throw std::invalid_argument("timecode counts 1 to 99 frames per second, not " +
                                rate_text(rate));
  }
  return static_cast<int>(base);
}

bool allows_timecode(capture::Rational rate) {
  return rate.num > 0 && rate.den > 0 && rounded(rate) >= 1 &&
         rounded(rate) <= most_frames_a_second;
}

bool allows_drop_frame(capture::Rational rate) {
  for (const std::int64_t base : {std::int64_t{30}, std::int64_t{60}}) {
    const std::int64_t multiple = rate.den / 1001;
    if (rate.den > 0 && rate.den % 1001 == 0 && rate.num % (base * 1000) == 0 &&
        rate.num / (base * 1000) == multiple) {
      return true;
    }
  }
  return false;
}

std::int64_t frames_since_midnight(const Timecode& timecode, capture::Rational rate) {
  const int base = timecode_base(rate);
  if (timecode.hours < 0 || timecode.hours > 23 || timecode.minutes < 0 || timecode.minutes > 59 ||
      timecode.seconds < 0 || timecode.seconds > 59 || timecode.frames < 0 ||
      timecode.frames >= base) {
    throw std::invalid_argument("no timecode " + to_string(timecode) + " at " + rate_text(rate));
  }
  const std::int64_t minutes = std::int64_t{timecode.hours} * 60 + timecode.minutes;
  const std::int64_t labels = (minutes * 60 + timecode.seconds) * base + timecode.frames;
  if (!timecode.drop_frame) return labels;
  require_drop_frame(rate);
  const int dropped = dropped_per_minute(base);
  if (timecode.minutes % 10 != 0 && timecode.seconds == 0 && timecode.frames < dropped) {
    throw std::invalid_argument("drop-frame counting leaves out timecode " + to_string(timecode));
  }
  return labels - dropped * (minutes - minutes / 10);
}

Timecode timecode_at(std::int64_t frames, capture::Rational rate, bool drop_frame) {
  const int base = timecode_base(rate);
  if (drop_frame) require_drop_frame(rate);
  const std::int64_t per_ten_minutes = frames_per_ten_minutes(base, drop_frame);
  const std::int64_t per_day = per_ten_minutes * 6 * 24;
  std::int64_t count = frames % per_day;
  if (count < 0) count += per_day;
  if (drop_frame) {
    // Give the left-out labels back; the first minute of ten has all of its own.
    const int dropped = dropped_per_minute(base);
    const std::int64_t tens = count / per_ten_minutes;
    const std::int64_t within = count % per_ten_minutes;
    const std::int64_t per_minute = std::int64_t{base} * 60 - dropped;
    const std::int64_t minute = within < dropped ? 0 : (within - dropped) / per_minute;
    count += dropped * (tens * 9 + minute);
  }
  Timecode timecode;
  timecode.drop_frame = drop_frame;
  timecode.frames = static_cast<int>(count % base);
  const std::int64_t seconds = count / base;
  timecode.seconds = static_cast<int>(seconds % 60);
  timecode.minutes = static_cast<int>(seconds / 60 % 60);
  timecode.hours = static_cast<int>(seconds / 3600);
  return timecode;
}

Timecode advance(const Timecode& start, std::int64_t frames, capture::Rational rate) {
  const std::int64_t first = frames_since_midnight(start, rate);
  const std::int64_t per_day =
      frames_per_ten_minutes(timecode_base(rate), start.drop_frame) * 6 * 24;
  return timecode_at(first + frames % per_day, rate, start.drop_frame);
}

std::string to_string(const Timecode& timecode) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%02d:%02d:%02d%c%02d", timecode.hours, timecode.minutes,
                timecode.seconds, timecode.drop_frame ? ';' : ':', timecode.frames);
  return text.data();
}

Timecode parse_timecode(std::string_view text, capture::Rational rate) {
  const auto is_digit = [&](std::size_t at) { return text[at] >= '0' && text[at] <= '9'; };
  bool well_formed =
      text.size() == 11 && text[2] == ':' && text[5] == ':' && (text[8] == ':' || text[8] == ';');
  for (std::size_t at = 0; well_formed && at < text.size(); ++at) {
    well_formed = at % 3 == 2 || is_digit(at);
  }
  if (!well_formed) {
    throw std::invalid_argument(
        "\"" + std::string(text) +
        "\" is no timecode: write hh:mm:ss:ff, or hh:mm:ss;ff for drop-frame");
  }
  const auto number = [&](std::size_t at) { return (text[at] - '0') * 10 + (text[at + 1] - '0'); };
  const Timecode timecode{number(0), number(3), number(6), number(9), text[8] == ';'};
  frames_since_midnight(timecode, rate);
  return timecode;
}

}  // namespace compositing
