// A made camera that is told exposures from frame to frame: thumbnails of a made scene, or pictures
// of it that they are taken of, with the truth of which exposure made which row, and everything
// that goes wrong with such cameras.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "capture/counter_random.h"
#include "capture/hdr.h"
#include "capture/radiance_check.h"

namespace made {

// Shares of frames, unless said otherwise.
struct StreamFaults {
  double dropped = 0.01;            // numbers leave it out
  double dropped_silently = 0.001;  // numbers do not
  double replaced = 0.003;          // the picture before it comes again in its place
  double inserted = 0.001;          // the picture before it comes again, and then this one
  double mixed = 0.005;             // upper rows have the exposure before, or lower ones the next
  double ignored = 0.005;           // of writes
  double burst = 0.0005;            // two or three lost in a row
  double person = 0.004;            // begins to walk through
  double lamp = 0.0003;             // switched: part of the picture
  double main_lamp = 0;             // switched: all of it, 1.2 to 6 times the light
  double reconnect = 0.00025;       // after 4 to 40 lost frames, with another lag
};

constexpr StreamFaults no_faults{.dropped = 0,
                                 .dropped_silently = 0,
                                 .replaced = 0,
                                 .inserted = 0,
                                 .mixed = 0,
                                 .ignored = 0,
                                 .burst = 0,
                                 .person = 0,
                                 .lamp = 0,
                                 .main_lamp = 0,
                                 .reconnect = 0};

struct StreamPlan {
  std::vector<double> exposures_s;
  double full_well_e = 15000;
  double read_e = 6;
  double bits = 12;
  double stops = 8;     // the scene's range
  double key = 0;       // stops by which the scene's middle is off what the bracket's middle wants
  double drift = 0.03;  // the most that light changes from frame to frame
  int most_lag = 6;
  int pixels = 1;  // along a cell's side; from 2 on thumbnails are taken of pictures
};

// What the camera sends, and what really made it.
struct MadeFrame {
  std::int64_t number = 0;
  capture::Thumbnail thumbnail;
  std::vector<double> row_exposure_s;  // of the picture's rows
  bool fresh = true;                   // not a picture sent once more
  int since_connected = 0;             // received frames since the camera came (back)
};

class ExposureStream {
 public:
  static constexpr int rows = 16;
  static constexpr int columns = 16;
  static constexpr int channels = 3;

  ExposureStream(StreamPlan plan, StreamFaults faults, std::uint64_t seed)
      : plan_(std::move(plan)), faults_(faults), random_(seed), noise_key_(seed) {
    lag_ = static_cast<int>(random_() % static_cast<unsigned>(plan_.most_lag + 1));
    default_s_ = plan_.exposures_s[0] * std::exp2(uniform(-4, 4));
    in_effect_s_ = last_in_effect_s_ = default_s_;
    make_scene();
  }

  int lag() const { return lag_; }
  // Of the thumbnails' values.
  capture::NoiseModel noise() const {
    return capture::noise_of_thumbnail(pixel_noise(), columns * plan_.pixels, rows * plan_.pixels);
  }
  capture::NoiseModel pixel_noise() const {
    const double step = 1 / (std::exp2(plan_.bits) - 1);
    const double read = plan_.read_e / plan_.full_well_e;
    return {.read = read * read + step * step / 12, .shot = 1 / plan_.full_well_e};
  }

  // Asked for after a frame was received.
  void request(double exposure_s) {
    if (!chance(faults_.ignored)) requests_.emplace_back(sensor_, exposure_s);
  }

  // The next frame that is received.
  MadeFrame next() {
    while (true) {
      if (again_) {
        again_ = false;
        return deliver(false);
      }
      if (chance(faults_.reconnect) && since_connected_ > 30) reconnect();
      if (chance(faults_.burst)) {
        for (int i = 0; i < 3; ++i) expose_one();
        number_ += 3;
      }
      expose_one();
      if (chance(faults_.dropped)) {
        ++number_;
        continue;
      }
      if (chance(faults_.dropped_silently)) continue;
      if (!sent_.values.empty() && chance(faults_.replaced)) return deliver(false);
      take_picture();
      again_ = chance(faults_.inserted);
      return deliver(true);
    }
  }

  // The values that an exposure gives now, without noise; NaN where pixels saturate in part.
  std::vector<float> values_of(double exposure_s) const {
    std::vector<float> values;
    if (plan_.pixels > 1) {
      std::vector<double> row_exposure_s(row_exposure_s_.size(), exposure_s);
      return capture::thumbnail_of(picture(row_exposure_s)).values;
    }
    for (std::size_t i = 0; i < base_.size(); ++i) {
      values.push_back(static_cast<float>(radiance_now(i) * exposure_s));
    }
    return values;
  }

  // The exposure that made a row of values, 0 = two.
  double made_by(const MadeFrame& frame, std::size_t row) const {
    const auto n = static_cast<std::size_t>(plan_.pixels);
    const auto& exposures_s = frame.row_exposure_s;
    if (n == 1) return exposures_s[row];
    if (row == 0) return exposures_s.front();
    if (row == rows - 1) return exposures_s.back();
    const std::size_t inner = rows * n - 2;
    const std::size_t first = 1 + (row - 1) * inner / (rows - 2);
    const std::size_t end = 1 + row * inner / (rows - 2);
    return exposures_s[first] == exposures_s[end - 1] ? exposures_s[first] : 0;
  }

  // For scripts.
  void set_light(double gain) { gain_ = gain; }
  void set_in_effect(std::optional<double> exposure_s) { stuck_s_ = exposure_s; }

 private:
  struct Person {
    double x = 0, speed = 0, width = 0;
    std::vector<float> radiance;  // (rows, channels)
  };

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  bool chance(double share) { return share > 0 && uniform(0, 1) < share; }

  void make_scene() {
    double middle = 0;
    for (const double t : plan_.exposures_s) middle += std::log2(t);
    middle /= static_cast<double>(plan_.exposures_s.size());
    middle_radiance_ = 0.25 * std::exp2(plan_.key - middle);
    base_.clear();
    lamp_.assign(std::size_t{rows} * columns * channels, 0);
    // Patches of a few cells, the upper ones brighter, as skies and lamps are.
    std::vector<double> patch(4 * 4);
    for (std::size_t i = 0; i < patch.size(); ++i) {
      patch[i] = uniform(-0.5, 0.5) + (static_cast<double>(i / 4) < 2 ? 0.15 : -0.15);
    }
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < columns; ++x) {
        const double stop = plan_.stops * 0.7 * patch[static_cast<std::size_t>(y / 4 * 4 + x / 4)] +
                            plan_.stops * 0.3 * uniform(-0.5, 0.5);
        for (int c = 0; c < channels; ++c) {
          base_.push_back(
              static_cast<float>(middle_radiance_ * std::exp2(stop + uniform(-0.4, 0.4))));
        }
      }
    }
    people_.clear();
    log_gain_ = 0;
    if (plan_.pixels == 1) return;
    for (std::size_t i = 0; i < base_.size() * static_cast<std::size_t>(plan_.pixels); ++i) {
      texture_.push_back(static_cast<float>(std::exp2(uniform(-0.5, 0.5))));
    }
    for (int i = 0; i < 1 << 16; ++i) {
      deviates_.push_back(static_cast<float>(capture::normal_deviate(random_())));
    }
  }

  // The picture without noise: cells of a common light, people at whole pixels, and a texture.
  capture::Image picture(const std::vector<double>& row_exposure_s) const {
    const int n = plan_.pixels;
    capture::Image image = capture::make_image(rows * n, columns * n, channels);
    const std::size_t row_size = image.index(1, 0);
    std::size_t i = 0;
    for (int y = 0; y < image.height; ++y) {
      const double light = light_ * row_exposure_s[static_cast<std::size_t>(y)];
      const float* texture = &texture_[static_cast<std::size_t>(y) * 31 % 16 * row_size];
      for (int x = 0; x < image.width; ++x) {
        const float* radiance = nullptr;
        for (const Person& person : people_) {
          const double at = (x + 0.5) / n;
          if (y / n >= 3 && at >= person.x && at < person.x + person.width) {
            radiance = &person.radiance[static_cast<std::size_t>(y / n * channels)];
          }
        }
        const std::size_t cell =
            static_cast<std::size_t>((y / n) * columns + x / n) * std::size_t{channels};
        for (std::size_t c = 0; c < channels; ++c, ++i) {
          const float own = radiance != nullptr ? radiance[c] : base_[cell + c] + lamp_[cell + c];
          image.pixels[i] = own * *texture++ * static_cast<float>(light);
        }
      }
    }
    return image;
  }

  void add_noise(capture::Image& image) {
    const capture::NoiseModel model = pixel_noise();
    const auto levels = static_cast<float>(std::exp2(plan_.bits) - 1);
    const auto read = static_cast<float>(std::pow(plan_.read_e / plan_.full_well_e, 2));
    const auto shot = static_cast<float>(model.shot);
    std::size_t at = 0;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
      if (i % 512 == 0) {
        at = capture::mixed_bits(noise_key_ + ++noise_count_) % (deviates_.size() - 512);
      }
      const float mean = image.pixels[i];
      const float noisy = mean + std::sqrt(read + shot * mean) * deviates_[at++];
      image.pixels[i] = std::min(std::max(std::nearbyint(noisy * levels), -64.0F) / levels, 1.0F);
    }
  }

  double radiance_now(std::size_t i) const {
    const auto c = i % channels;
    const auto x = static_cast<int>(i / channels % columns);
    const auto y = i / (std::size_t{channels} * columns);
    for (const Person& person : people_) {
      if (x >= person.x && x < person.x + person.width && y >= 3) {
        return person.radiance[y * channels + c] * light_;
      }
    }
    return (base_[i] + lamp_[i]) * light_;
  }

  // One period of the sensor: the world goes on, and the exposure in effect with it.
  void expose_one() {
    ++sensor_;
    last_in_effect_s_ = in_effect_s_;
    while (!requests_.empty() && requests_.front().first <= sensor_ - 1 - lag_) {
      in_effect_s_ = requests_.front().second;
      requests_.pop_front();
    }
    if (sensor_ % 64 == 0) drift_ = uniform(-1, 1) < 0 ? -plan_.drift : plan_.drift;
    if (sensor_ % 256 < 96) {
      log_gain_ +=
          std::abs(log_gain_) > 1.5 ? -std::copysign(plan_.drift * 0.9, log_gain_) : drift_ * 0.97;
    }
    light_ = std::exp(log_gain_) * main_ * gain_;
    for (Person& person : people_) person.x += person.speed;
    std::erase_if(people_, [](const Person& p) { return p.x > columns || p.x + p.width < 0; });
    if (people_.size() < 2 && chance(faults_.person)) walk_in();
    if (chance(faults_.lamp)) switch_lamp();
    if (chance(faults_.main_lamp)) main_ = main_ > 1 ? 1 : uniform(1.2, 6);
  }

  void walk_in() {
    const bool left = chance(0.5);
    Person person{.x = left ? -2.0 : columns,
                  .speed = (left ? 1 : -1) * uniform(0.03, 0.4),
                  .width = uniform(1.5, 3.5),
                  .radiance = {}};
    for (int y = 0; y < rows; ++y) {
      const double stop = uniform(-0.3, 0.3) * plan_.stops;
      for (int c = 0; c < channels; ++c) {
        person.radiance.push_back(
            static_cast<float>(middle_radiance_ * std::exp2(stop + uniform(-0.4, 0.4))));
      }
    }
    people_.push_back(std::move(person));
  }

  // Light that falls off from the middle of a lamp.
  void switch_lamp() {
    if (lamp_on_) {
      std::ranges::fill(lamp_, 0.0F);
    } else {
      const double x0 = uniform(0, columns);
      const double y0 = uniform(0, rows);
      const double power = middle_radiance_ * std::exp2(uniform(-1, 3));
      for (std::size_t i = 0; i < lamp_.size(); ++i) {
        const double x = static_cast<double>(i / channels % columns) - x0;
        const double y = static_cast<double>(i / (std::size_t{channels} * columns)) - y0;
        lamp_[i] = static_cast<float>(power / (1 + (x * x + y * y) / 4));
      }
    }
    lamp_on_ = !lamp_on_;
  }

  void reconnect() {
    const int lost = static_cast<int>(4 + random_() % 37);
    for (int i = 0; i < lost; ++i) expose_one();
    number_ += lost;
    requests_.clear();
    lag_ = static_cast<int>(random_() % static_cast<unsigned>(plan_.most_lag + 1));
    // Set as it was last, or as it was at first.
    if (chance(0.5)) in_effect_s_ = default_s_;
    last_in_effect_s_ = in_effect_s_;
    since_connected_ = 0;
  }

  void take_picture() {
    const int picture_rows = rows * plan_.pixels;
    row_exposure_s_.assign(static_cast<std::size_t>(picture_rows), stuck_s_.value_or(in_effect_s_));
    if (chance(faults_.mixed)) {
      // The upper rows still have the exposure before.
      const auto border = static_cast<std::size_t>(uniform(1, picture_rows));
      std::fill_n(row_exposure_s_.begin(), border, last_in_effect_s_);
    }
    if (plan_.pixels > 1) {
      capture::Image image = picture(row_exposure_s_);
      add_noise(image);
      sent_ = capture::thumbnail_of(image);
      return;
    }
    sent_ = {rows, columns, channels, {}};
    sent_.values.reserve(base_.size());
    const double step = 1 / (std::exp2(plan_.bits) - 1);
    const capture::NoiseModel model{.read = std::pow(plan_.read_e / plan_.full_well_e, 2),
                                    .shot = 1 / plan_.full_well_e};
    for (std::size_t i = 0; i < base_.size(); ++i) {
      const double mean = radiance_now(i) * row_exposure_s_[i / (std::size_t{channels} * columns)];
      const double noisy =
          mean + std::sqrt(model.variance(mean)) *
                     capture::normal_deviate(capture::mixed_bits(noise_key_ + ++noise_count_));
      sent_.values.push_back(
          static_cast<float>(std::clamp(std::round(noisy / step) * step, -64 * step, 1.0)));
    }
  }

  MadeFrame deliver(bool fresh) {
    return {number_++, sent_, row_exposure_s_, fresh, since_connected_++};
  }

  StreamPlan plan_;
  StreamFaults faults_;
  std::mt19937_64 random_;
  std::uint64_t noise_key_;
  std::uint64_t noise_count_ = 0;

  double middle_radiance_ = 1;
  std::vector<float> base_, lamp_;
  std::vector<float> texture_, deviates_;  // of pictures
  std::vector<Person> people_;
  bool lamp_on_ = false;
  double log_gain_ = 0, drift_ = 0, main_ = 1, gain_ = 1, light_ = 1;

  std::int64_t sensor_ = 0;  // periods
  std::int64_t number_ = 0;  // of the next frame that is received
  int lag_ = 0;
  int since_connected_ = 0;
  double default_s_ = 1;
  double in_effect_s_ = 1, last_in_effect_s_ = 1;
  std::optional<double> stuck_s_;
  std::deque<std::pair<std::int64_t, double>> requests_;  // period, exposure
  capture::Thumbnail sent_;
  std::vector<double> row_exposure_s_;
  bool again_ = false;
};

}  // namespace made
