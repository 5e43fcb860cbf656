// Votes of a thumbnail's values on a frame's exposure.
#include "capture/radiance_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "capture/median.h"

namespace capture {
namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();
// Deviations that noise does not reach.
constexpr float certain = 3;
// Of those, that it does not reach in one value of many.
constexpr float surely = 5.5F / certain;
// Drifting light reaches its limit at this many of its deviations.
constexpr double drift_limit = 3;
constexpr int least_votes = 16;
constexpr int votes_of_stretch = 8;
// The votes of a value, of those for the tried exposure, that is what it should be; one that should
// be saturated has a single one, since whatever is bright looks so.
constexpr int votes_of_value = 4;
constexpr int votes_of_end = 2;
constexpr double most_agreeing_of_end = 0.25;
constexpr double least_share = 0.6;
// Of the values that tell finely, those that persons and lamps leave as they were.
constexpr double least_core = 0.4;
// The exposures just beyond the shortest and longest in play, that light which jumps looks like.
constexpr double beyond = 4;
// Light is the known one within this ratio.
constexpr float near = 1.1F;
// Noise of values that tell whether it is.
constexpr float finest = 0.25F;
// Noise of values that tell how far all light has drifted (three deviations, as all here).
constexpr float finest_of_drift = 0.1F;
// The share of drift that is not of all light alike.
constexpr float uneven = 0.25F;
// Values of one age that tell it, at least.
constexpr std::size_t least_followed = 8;
// Older light than this many frames is not followed.
constexpr std::size_t longest_followed = 32;

bool enough(int agreeing, int telling) { return agreeing >= least_share * telling; }

}  // namespace

// The variance of a value by the noise model's terms.
struct RadianceReference::Variance {
  float read, shot, relative_squared;
  float operator()(float value) const { return read + value * (shot + value * relative_squared); }
};

// What values may be if the tried exposure is true, and what the frame's are.
struct RadianceReference::Limits {
  explicit Limits(std::size_t size) : lower(size), upper(size), variance(size), vote(size) {}
  std::vector<float> lower, upper;
  std::vector<float> variance;  // of the radiance
  // The radiance and its variance, where the frame itself tells how all light has drifted.
  std::vector<float> followed, followed_variance;
  std::vector<std::int32_t> vote;  // -1 below, 0 between, 1 above; 2 = no value
};

struct RadianceReference::Votes {
  int telling = 0;
  int agreeing = 0;
  int surprising = 0;  // that do not tell, but are on the wrong side of what is known
};

// The values that an exposure would have given.
struct RadianceReference::Band {
  float low, high;
  float surely_low, surely_high;  // noise alone does not reach beyond
};

// What an exposure would have given, and how far noise may take a value from it.
struct RadianceReference::Expected {
  float value, away;
};

RadianceReference::Expected RadianceReference::expect(
    float radiance, float variance, float scale, float exposure_s, const Variance& noise) const {
  const float value = std::min(std::max(radiance * exposure_s, 0.0F), infinite);
  return {value, certain * std::sqrt(scale * noise(std::min(value, saturation_)) +
                                     variance * exposure_s * exposure_s)};
}

RadianceReference::Band RadianceReference::band_of(std::size_t i,
                                                   float exposure_s,
                                                   const Limits& limits,
                                                   const Variance& noise) const {
  const auto [expected, away] =
      expect(limits.followed[i], limits.followed_variance[i], scale_[i], exposure_s, noise);
  return {std::min(expected - away, saturation_), std::min(expected + away, saturation_),
          expected - surely * away, expected + surely * away};
}

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
    scale_.assign(thumbnail.values.size(), 1);
    const auto edge_values = static_cast<std::ptrdiff_t>(row_size_);
    std::fill_n(scale_.begin(), edge_values, thumbnail.edge_variance);
    std::fill_n(scale_.rbegin(), edge_values, thumbnail.edge_variance);
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
      if (expected +
              certain * std::sqrt(aged * t * t + scale_[i] * noise(std::max(expected, 0.0F))) <
          saturation_) {
        variance_[i] = infinite;
      }
      continue;
    }
    const float radiance = value / t;
    const float variance = scale_[i] * noise(std::max(value, 0.0F)) / (t * t);
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
    const float away = certain * std::sqrt(scale_[i] * noise(expected) + variance * t * t);
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
  std::int32_t telling = 0;
  std::int32_t agreeing = 0;
  std::int32_t surprising = 0;
  for (std::size_t i = 0; i < radiance_.size(); ++i) {
    const auto [expected, away] = expect(radiance_[i], limits.variance[i], scale_[i], t, noise);
    const bool tells = (longer ? std::min(expected - away, saturation_) >= limits.upper[i]
                               : expected + away <= limits.lower[i]) &
                       (limits.vote[i] != 2);
    telling += tells;
    const bool wrong = limits.vote[i] == (longer ? 1 : -1);
    agreeing += tells & !wrong;
    surprising += wrong & !tells;
  }
  return {telling, agreeing, surprising};
}

// All light drifts alike, but for a part of it: light that was seen as long ago as others has
// drifted as much as they have. So how much is the median of values that tell it finely.
void RadianceReference::follow_drift(const Thumbnail& thumbnail,
                                     std::int64_t number,
                                     float exposure_s,
                                     Limits& limits) const {
  const Variance noise{read_, shot_, relative_squared_};
  const auto now = static_cast<std::int32_t>(number - first_number_);
  std::array<std::vector<float>, longest_followed> ratios;  // by age
  const auto age_of = [&](std::size_t i) { return static_cast<std::size_t>(now - taken_at_[i]); };
  for (std::size_t i = 0; i < radiance_.size(); ++i) {
    const std::size_t age = age_of(i);
    const float value = thumbnail.values[i];
    if (age == 0 || age >= longest_followed || !(value < saturation_)) continue;
    const float expected = radiance_[i] * exposure_s;
    const float away = certain * std::sqrt(scale_[i] * noise(std::max(expected, 0.0F)) +
                                           variance_[i] * exposure_s * exposure_s);
    const float drift = certain * std::sqrt(drift_squared_) * static_cast<float>(age) * expected;
    if (away < finest_of_drift * expected && std::abs(value - expected) <= away + drift) {
      ratios[age].push_back(value / expected);
    }
  }
  std::array<float, longest_followed> drifted{};  // 0 = not known
  for (std::size_t age = 0; age < longest_followed; ++age) {
    std::vector<float>& of_age = ratios[age];
    if (of_age.size() < least_followed) continue;
    const float median = median_in_place(of_age);
    const float apart = finest_of_drift / 2 +
                        uneven * certain * std::sqrt(drift_squared_) * static_cast<float>(age);
    const auto alike = std::ranges::count_if(
        of_age, [&](float ratio) { return std::abs(ratio - median) <= apart; });
    if (enough(static_cast<int>(alike), static_cast<int>(of_age.size()))) drifted[age] = median;
  }
  limits.followed = radiance_;
  limits.followed_variance = limits.variance;
  for (std::size_t i = 0; i < radiance_.size(); ++i) {
    const std::size_t age = age_of(i);
    if (age >= longest_followed || drifted[age] == 0) continue;
    const auto frames = static_cast<float>(age);
    limits.followed[i] *= drifted[age];
    limits.followed_variance[i] = variance_[i] + uneven * uneven * frames * frames *
                                                     drift_squared_ * radiance_[i] * radiance_[i];
  }
}

// Whether rows that begin at one end have the values of another exposure: those that it would have
// changed, and that were not changed by something that moved.
bool RadianceReference::made_in_part(double partner_s,
                                     const Thumbnail& thumbnail,
                                     const TriedExposure& tried,
                                     const Limits& limits,
                                     bool top) const {
  const Variance noise{read_, shot_, relative_squared_};
  const auto t = static_cast<float>(tried.exposure_s);
  const auto p = static_cast<float>(partner_s);
  int as_tried = 0;
  int as_partner = 0;  // twice for what noise alone cannot be
  for (int i = 0; i < rows_ && as_tried < votes_of_stretch * votes_of_value; ++i) {
    const auto row = static_cast<std::size_t>(top ? i : rows_ - 1 - i);
    std::int32_t of_tried = 0;
    std::int32_t of_partner = 0;
    for (std::size_t j = row * row_size_; j < (row + 1) * row_size_; ++j) {
      const Band own = band_of(j, t, limits, noise);
      const Band other = band_of(j, p, limits, noise);
      const float value = std::min(thumbnail.values[j], saturation_);
      const bool tells = (own.high < other.low) | (other.high < own.low);
      const bool surely_other = (value < own.surely_low) | (value > own.surely_high);
      const int votes = own.low < saturation_ ? votes_of_value : 1;
      of_tried += (tells & (value >= own.low) & (value <= own.high)) * votes;
      of_partner += (tells & (value >= other.low) & (value <= other.high)) * (1 + surely_other);
    }
    as_tried += of_tried;
    as_partner += of_partner;
    if (as_partner >= votes_of_end &&
        2 * as_tried <= most_agreeing_of_end * votes_of_value * as_partner)
      return true;
  }
  return false;
}

// How many values are what is known, and not only nearer to it than to another exposure's.
RadianceReference::Nearness RadianceReference::nearness_of(const Thumbnail& thumbnail,
                                                           const TriedExposure& tried,
                                                           const Limits& limits) const {
  const Variance noise{read_, shot_, relative_squared_};
  const auto t = static_cast<float>(tried.exposure_s);
  Nearness result;
  std::int32_t telling = 0;
  std::int32_t agreeing = 0;
  for (std::size_t i = 0; i < radiance_.size(); ++i) {
    const auto [expected, away] = expect(radiance_[i], limits.variance[i], scale_[i], t, noise);
    const float high = expected * near + away;
    const float low = expected / near - away;
    const float value = thumbnail.values[i];
    const bool tells = (away < finest * expected) & (high < saturation_) & (limits.vote[i] != 2);
    telling += tells;
    agreeing += tells & (value >= low) & (value <= high);
  }
  return {telling, agreeing};
}

double RadianceReference::brighter_than(const RadianceReference& other) const {
  const auto fine = [](const RadianceReference& light, std::size_t i) {
    return certain * std::sqrt(light.variance_[i]) < finest_of_drift * light.radiance_[i];
  };
  std::vector<float> ratios;
  for (std::size_t i = 0; i < std::min(radiance_.size(), other.radiance_.size()); ++i) {
    if (fine(*this, i) && fine(other, i)) ratios.push_back(radiance_[i] / other.radiance_[i]);
  }
  if (ratios.size() < least_votes) return 1;
  return median_in_place(ratios);
}

FitResult RadianceReference::check(const Thumbnail& thumbnail,
                                   std::int64_t number,
                                   const TriedExposure& tried) const {
  if (empty()) return {};
  if (thumbnail.rows != rows_ || thumbnail.row_size() != row_size_ ||
      thumbnail.values.size() != radiance_.size()) {
    throw std::invalid_argument("thumbnails of one camera have one size");
  }
  Limits limits = limits_of(thumbnail, number, tried);
  struct Other {
    double exposure_s;
    bool needed;  // must be told from
  };
  const double t = tried.exposure_s;
  const bool alone = tried.shorter_s <= 0 && tried.longer_s <= 0;
  std::vector<Other> others{
      {tried.shorter_s > 0 ? tried.shorter_s : t / beyond, tried.shorter_s > 0 || alone},
      {tried.longer_s > 0 ? tried.longer_s : t * beyond, tried.longer_s > 0 || alone}};
  for (const auto& partners_s : {tried.before_s, tried.after_s}) {
    for (const double other : partners_s) {
      if (other > 0 && (other < others[0].exposure_s || other > others[1].exposure_s)) {
        others.push_back({other, false});
      }
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
  }
  if (tried.before_s[0] > 0 || tried.after_s[0] > 0) {
    follow_drift(thumbnail, number, static_cast<float>(t), limits);
  }
  for (const bool top : {true, false}) {
    for (const double partner_s : top ? tried.before_s : tried.after_s) {
      result.in_part |= partner_s > 0 && made_in_part(partner_s, thumbnail, tried, limits, top);
    }
  }
  const Nearness nearness = nearness_of(thumbnail, tried, limits);
  result.near = nearness.telling >= least_votes && enough(nearness.agreeing, nearness.telling);
  contradicted |=
      nearness.telling >= least_votes && nearness.agreeing < least_core * nearness.telling;
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
