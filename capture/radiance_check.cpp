// Votes of a thumbnail's values on a frame's exposure.
#include "capture/radiance_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace capture {
namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();
// Deviations that noise does not reach.
constexpr float certain = 3;
// Drifting light reaches its limit at this many of its deviations.
constexpr double drift_limit = 3;
constexpr int least_votes = 16;
constexpr int votes_of_stretch = 8;
constexpr int votes_of_end = 4;
constexpr double most_agreeing_of_end = 0.25;
constexpr double least_share = 0.6;
// The exposures just beyond the shortest and longest in play, that light which jumps looks like.
constexpr double beyond = 4;
// Light is the known one within this ratio.
constexpr float near = 1.25F;

// The variance of a value by the noise model's terms.
struct Variance {
  float read, shot, relative_squared;
  float operator()(float value) const { return read + value * (shot + value * relative_squared); }
};

bool enough(int agreeing, int telling) { return agreeing >= least_share * telling; }

// The rows at one end of the picture, if too few of their votes agree; else none. Rows are counted
// from that end.
template <class Rows>
std::size_t contradicting_end(const Rows& rows, bool top) {
  int telling = 0;
  int agreeing = 0;
  for (std::size_t i = 0; i < rows.size() && telling < votes_of_stretch; ++i) {
    const auto& row = rows[top ? i : rows.size() - 1 - i];
    telling += row.telling;
    agreeing += row.agreeing;
    if (telling >= votes_of_end && agreeing <= most_agreeing_of_end * telling) return i + 1;
  }
  return 0;
}

}  // namespace

Thumbnail thumbnail_of(const Image& image, int rows, int columns, double saturation) {
  if (image.empty() || rows < 1 || columns < 1) {
    throw std::invalid_argument("a thumbnail needs a picture, rows and columns");
  }
  Thumbnail thumbnail{
      std::min(rows, image.height), std::min(columns, image.width), image.channels, {}};
  const std::size_t row_size = thumbnail.row_size();
  const auto channels = static_cast<std::size_t>(image.channels);
  const auto limit = static_cast<float>(saturation);
  const auto edge = [](int i, int count, int size) {
    return static_cast<int>(std::int64_t{i} * size / count);
  };
  thumbnail.values.reserve(static_cast<std::size_t>(thumbnail.rows) * row_size);
  std::vector<double> sums(row_size);
  std::vector<int> saturated(row_size);
  for (int row = 0; row < thumbnail.rows; ++row) {
    std::ranges::fill(sums, 0.0);
    std::ranges::fill(saturated, 0);
    const int first = edge(row, thumbnail.rows, image.height);
    const int end = edge(row + 1, thumbnail.rows, image.height);
    for (int y = first; y < end; ++y) {
      for (int column = 0; column < thumbnail.columns; ++column) {
        const float* value =
            &image.pixels[image.index(y, edge(column, thumbnail.columns, image.width))];
        const float* stop =
            image.pixels.data() + image.index(y, 0) +
            static_cast<std::size_t>(edge(column + 1, thumbnail.columns, image.width)) * channels;
        const std::size_t cell = static_cast<std::size_t>(column) * channels;
        for (; value < stop; value += channels) {
          for (std::size_t c = 0; c < channels; ++c) {
            sums[cell + c] += value[c];
            saturated[cell + c] += value[c] >= limit ? 1 : 0;
          }
        }
      }
    }
    for (int column = 0; column < thumbnail.columns; ++column) {
      const int pixels = (end - first) * (edge(column + 1, thumbnail.columns, image.width) -
                                          edge(column, thumbnail.columns, image.width));
      for (std::size_t c = 0; c < channels; ++c) {
        const std::size_t i = static_cast<std::size_t>(column) * channels + c;
        const bool in_part = saturated[i] > 0 && saturated[i] < pixels;
        thumbnail.values.push_back(in_part ? std::numeric_limits<float>::quiet_NaN()
                                           : static_cast<float>(sums[i] / pixels));
      }
    }
  }
  return thumbnail;
}

NoiseModel noise_of_thumbnail(
    const NoiseModel& noise, int width, int height, int rows, int columns) {
  // Interpolated colours of neighbours are not independent: four of them count as one.
  const double cells = static_cast<double>(std::min(rows, height)) * std::min(columns, width);
  const double independent = std::max(1.0, static_cast<double>(width) * height / cells / 4);
  NoiseModel of_means = noise;
  of_means.read /= independent;
  of_means.shot /= independent;
  return of_means;
}

// What values may be if the tried exposure is true, and what the frame's are.
struct RadianceReference::Limits {
  explicit Limits(std::size_t size) : lower(size), upper(size), variance(size), vote(size) {}
  std::vector<float> lower, upper;
  std::vector<float> variance;     // of the radiance
  std::vector<std::int32_t> vote;  // -1 below, 0 between, 1 above; 2 = no value
};

struct RadianceReference::Votes {
  struct Row {
    int telling = 0;
    int agreeing = 0;
  };
  std::vector<Row> rows;
  int telling = 0;
  int agreeing = 0;
  int surprising = 0;  // that do not tell, but are on the wrong side of what is known
};

RadianceReference::RadianceReference(const NoiseModel& noise, double light_drift)
    : read_(static_cast<float>(noise.read)),
      shot_(static_cast<float>(noise.shot)),
      relative_squared_(static_cast<float>(noise.relative * noise.relative)),
      saturation_(static_cast<float>(noise.saturation)),
      drift_squared_(static_cast<float>(std::pow(light_drift / drift_limit, 2))) {
  if (!(noise.read > 0 && noise.shot >= 0 && noise.saturation > 0 && light_drift >= 0)) {
    throw std::invalid_argument("labels need noise at black, a saturation, and a drift of light");
  }
}

void RadianceReference::clear() {
  radiance_.clear();
  variance_.clear();
  taken_at_.clear();
}

void RadianceReference::take(const Thumbnail& thumbnail, double exposure_s, std::int64_t number) {
  if (empty()) {
    rows_ = thumbnail.rows;
    row_size_ = thumbnail.row_size();
    first_number_ = number;
    radiance_.assign(thumbnail.values.size(), 0);
    variance_.assign(thumbnail.values.size(), infinite);
    taken_at_.assign(thumbnail.values.size(), 0);
  }
  const Variance noise{read_, shot_, relative_squared_};
  const auto t = static_cast<float>(exposure_s);
  const auto now = static_cast<std::int32_t>(number - first_number_);
  for (std::size_t i = 0; i < radiance_.size(); ++i) {
    const float value = thumbnail.values[i];
    if (!std::isfinite(value)) continue;
    const float age = static_cast<float>(now - taken_at_[i]);
    const float old = radiance_[i];
    const float aged = variance_[i] + age * age * drift_squared_ * old * old;
    if (value >= saturation_) {
      const float expected = old * t;
      if (expected + certain * std::sqrt(aged * t * t + noise(std::max(expected, 0.0F))) <
          saturation_) {
        variance_[i] = infinite;
      }
      continue;
    }
    const float radiance = value / t;
    const float variance = noise(std::max(value, 0.0F)) / (t * t);
    const float difference = radiance - old;
    if (!(variance > aged && difference * difference <= certain * certain * (variance + aged))) {
      radiance_[i] = radiance;
      variance_[i] = variance;
      taken_at_[i] = now;
    }
  }
}

RadianceReference::Limits RadianceReference::limits_of(const Thumbnail& thumbnail,
                                                       std::int64_t number,
                                                       const TriedExposure& tried) const {
  const Variance noise{read_, shot_, relative_squared_};
  const auto t = static_cast<float>(tried.exposure_s);
  const double longer = tried.longer_s > 0 ? tried.longer_s / tried.exposure_s : beyond;
  const double shorter = tried.shorter_s > 0 ? tried.shorter_s / tried.exposure_s : 1 / beyond;
  const auto up = static_cast<float>(std::sqrt(longer));
  const auto down = static_cast<float>(std::sqrt(shorter));
  const auto now = static_cast<std::int32_t>(number - first_number_);
  const float below = std::nextafter(saturation_, 0.0F);
  Limits limits(radiance_.size());
  for (std::size_t i = 0; i < radiance_.size(); ++i) {
    const float age = static_cast<float>(now - taken_at_[i]);
    const float variance = variance_[i] + age * age * drift_squared_ * radiance_[i] * radiance_[i];
    const float expected = std::max(radiance_[i] * t, 0.0F);
    const float away = certain * std::sqrt(noise(expected) + variance * t * t);
    // What should not saturate, but does, is not to be taken for a little more light.
    const float upper =
        std::max(expected + away < saturation_ ? std::min(expected * up, below) : expected * up,
                 expected + away);
    const float lower = std::min(std::min(expected * down, expected - away), saturation_);
    const float given = thumbnail.values[i];
    const float value = given >= saturation_ ? infinite : given;
    limits.upper[i] = upper;
    limits.lower[i] = lower;
    limits.variance[i] = variance;
    const std::int32_t side = static_cast<std::int32_t>(value > upper && upper < saturation_) -
                              static_cast<std::int32_t>(value < lower);
    limits.vote[i] = given == given && given > -infinite ? side : 2;
  }
  return limits;
}

RadianceReference::Votes RadianceReference::votes_against(double other_s,
                                                          const TriedExposure& tried,
                                                          const Limits& limits) const {
  const Variance noise{read_, shot_, relative_squared_};
  const auto t = static_cast<float>(other_s);
  const bool longer = other_s > tried.exposure_s;
  Votes votes;
  votes.rows.resize(static_cast<std::size_t>(rows_));
  for (std::size_t row = 0; row < votes.rows.size(); ++row) {
    std::int32_t telling = 0;
    std::int32_t agreeing = 0;
    std::int32_t surprising = 0;
    for (std::size_t i = row * row_size_; i < (row + 1) * row_size_; ++i) {
      const float expected = std::min(std::max(radiance_[i] * t, 0.0F), infinite);
      const float away =
          certain * std::sqrt(noise(std::min(expected, saturation_)) + limits.variance[i] * t * t);
      const bool tells = (longer ? std::min(expected - away, saturation_) >= limits.upper[i]
                                 : expected + away <= limits.lower[i]) &
                         (limits.vote[i] != 2);
      telling += tells;
      const bool wrong = limits.vote[i] == (longer ? 1 : -1);
      agreeing += tells & !wrong;
      surprising += wrong & !tells;
    }
    votes.rows[row] = {telling, agreeing};
    votes.telling += telling;
    votes.agreeing += agreeing;
    votes.surprising += surprising;
  }
  return votes;
}

// Whether the values at one end that contradict are what an exposure in effect shortly before or
// after would have made of them: if not, something moved.
bool RadianceReference::made_by_partner(const Thumbnail& thumbnail,
                                        const TriedExposure& tried,
                                        const Limits& limits,
                                        std::size_t rows,
                                        bool top) const {
  const std::size_t size = rows * row_size_;
  const std::size_t begin = top ? 0 : radiance_.size() - size;
  const Variance noise{read_, shot_, relative_squared_};
  for (const double partner_s : tried.partners_s) {
    if (partner_s <= 0) continue;
    const auto t = static_cast<float>(partner_s);
    int contradicting = 0;
    int made = 0;
    for (std::size_t i = begin; i < begin + size; ++i) {
      if (limits.vote[i] == 0 || limits.vote[i] == 2) continue;
      ++contradicting;
      const float expected = std::min(std::max(radiance_[i] * t, 0.0F), infinite);
      const float away =
          certain * std::sqrt(noise(std::min(expected, saturation_)) + limits.variance[i] * t * t);
      const float value = std::min(thumbnail.values[i], saturation_);
      made += value >= std::min({expected / near, expected - away, saturation_}) &&
              value <= std::max(expected * near, expected + away);
    }
    if (enough(made, contradicting)) return true;
  }
  return false;
}

FitResult RadianceReference::check(const Thumbnail& thumbnail,
                                   std::int64_t number,
                                   const TriedExposure& tried) const {
  if (empty()) return {};
  if (thumbnail.rows != rows_ || thumbnail.row_size() != row_size_ ||
      thumbnail.values.size() != radiance_.size()) {
    throw std::invalid_argument("thumbnails of one camera have one size");
  }
  const Limits limits = limits_of(thumbnail, number, tried);
  struct Other {
    double exposure_s;
    bool needed;  // must be told from
  };
  const double t = tried.exposure_s;
  const bool alone = tried.shorter_s <= 0 && tried.longer_s <= 0;
  std::vector<Other> others{
      {tried.shorter_s > 0 ? tried.shorter_s : t / beyond, tried.shorter_s > 0 || alone},
      {tried.longer_s > 0 ? tried.longer_s : t * beyond, tried.longer_s > 0 || alone}};
  for (const double other : tried.partners_s) {
    if (other > 0 && (other < others[0].exposure_s || other > others[1].exposure_s)) {
      others.push_back({other, false});
    }
  }
  FitResult result{
      .fit = Fit::agrees, .agreeing = 1, .telling_least = std::numeric_limits<int>::max()};
  bool contradicted = false;
  for (const Other& other : others) {
    const Votes votes = votes_against(other.exposure_s, tried, limits);
    if (other.needed) result.telling_least = std::min(result.telling_least, votes.telling);
    if (votes.telling > 0) {
      result.agreeing = std::min(result.agreeing, double(votes.agreeing) / votes.telling);
    }
    const int all = votes.telling + (votes.telling < least_votes ? votes.surprising : 0);
    contradicted |= all >= least_votes && !enough(votes.agreeing, all);
    for (const bool top : {true, false}) {
      const std::size_t rows = contradicting_end(votes.rows, top);
      result.in_part |= rows > 0 && made_by_partner(thumbnail, tried, limits, rows, top);
    }
  }
  result.tells = result.telling_least >= least_votes;
  if (contradicted || result.in_part) {
    result.fit = Fit::contradicts;
    result.in_part &= !contradicted;
  } else if (!result.tells) {
    result.fit = Fit::silent;
  }
  return result;
}

}  // namespace capture
