// The chart of the HDR merge.
#include "studio/charts/hdr.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "capture/hdr.h"
#include "capture/live_merge.h"
#include "capture/made_sensor.h"
#include "capture/median.h"
#include "studio/charts/opencv_merge.h"
#include "studio/machine.h"

namespace studio {
namespace {

using capture::Image;
using capture::MadeSensor;
using capture::MergedFrame;
using capture::MergeStatus;

// A camera goes from the shortest to the longest exposure and back, so that the newest is neither.
constexpr double exposures_s[] = {1.0 / 64, 1.0, 1.0 / 1024, 1.0 / 4, 1.0 / 256};
constexpr std::size_t members = std::size(exposures_s);
constexpr double stops = 12;  // of the scene, below what the shortest exposure holds

MadeSensor sensor_of(int bits) {
  return {
      .full_well_e = 20000, .read_noise_e = 4, .bits = bits, .pedestal = bits == 8 ? 4.0 : 64.0};
}

// Slopes, edges and texture, with a colour that changes over the picture. The brightest radiance is
// that which saturates the shortest exposure, times `light`.
Image made_scene(int side, double light) {
  Image image = capture::make_image(side, side);
  const double shortest = *std::ranges::min_element(exposures_s);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double u = static_cast<double>(x) / side;
      const double v = static_cast<double>(y) / side;
      const double slope = std::sin(9 * u + 2 * std::sin(7 * v)) * std::cos(6 * v);
      const double edge = (static_cast<int>(8 * u) + static_cast<int>(8 * v)) % 2 == 0 ? 0.5 : -0.5;
      const double texture = 1 + 0.1 * std::sin(40 * u) * std::sin(33 * v);
      for (int c = 0; c < 3; ++c) {
        const double below = stops * (slope - 1) / 2 + edge + 0.5 * std::sin(5 * u + c) - 1.2;
        image.at(y, x, c) = static_cast<float>(light / shortest * texture * std::exp2(below));
      }
    }
  }
  return image;
}

// The shots of a window, the newest last, in every form that a merge takes.
struct Shots {
  MadeSensor sensor;
  int side = 0;
  std::vector<capture::MadeShot> taken;
  std::vector<std::vector<std::uint8_t>> bytes;
  std::vector<Image> linear;
  std::vector<double> exposures_s;

  double white() const { return (1 << sensor.bits) - 1; }
  capture::LinearCodes codes() const {
    const double black = sensor.pedestal;
    return {side, side, {black, black, black}, {white(), white(), white()}};
  }
  std::vector<capture::CodedShot16> coded16() const {
    std::vector<capture::CodedShot16> shots;
    for (std::size_t i = 0; i < taken.size(); ++i)
      shots.push_back({taken[i].codes, exposures_s[i]});
    return shots;
  }
  std::vector<capture::CodedShot8> coded8() const {
    std::vector<capture::CodedShot8> shots;
    for (std::size_t i = 0; i < taken.size(); ++i) shots.push_back({bytes[i], exposures_s[i]});
    return shots;
  }
  std::vector<capture::LiveShot> live() const {
    std::vector<capture::LiveShot> shots;
    for (std::size_t i = 0; i < taken.size(); ++i) shots.push_back({&linear[i], exposures_s[i]});
    return shots;
  }
};

// What a camera saw; `scenes` are of each of the window's frames, or one for all.
Shots take(const MadeSensor& sensor,
           const std::vector<Image>& scenes,
           const std::vector<double>& exposures) {
  Shots shots{sensor, scenes[0].width, {}, {}, {}, exposures};
  for (std::size_t i = 0; i < exposures.size(); ++i) {
    const Image& scene = scenes[std::min(i, scenes.size() - 1)];
    shots.taken.push_back(expose(sensor, scene, exposures[i], i));
    const auto& codes = shots.taken.back().codes;
    if (sensor.bits == 8) shots.bytes.emplace_back(codes.begin(), codes.end());
    shots.linear.push_back(capture::make_image(shots.side, shots.side));
    std::ranges::transform(codes, shots.linear.back().pixels.begin(), [&](std::uint16_t code) {
      return static_cast<float>((code - sensor.pedestal) / (shots.white() - sensor.pedestal));
    });
  }
  return shots;
}

MergedFrame merged(const Shots& shots, bool level_flicker = false) {
  MergedFrame frame;
  merge_window(shots.coded16(), shots.codes(),
               {.noise = noise_of(shots.sensor), .level_flicker = level_flicker}, frame);
  return frame;
}

struct Error {
  double rms_stops = 0;
  double p99_stops = 0;
};

// Of radiance known up to a factor, which is the median's. Values not above 0 count as 12 stops
// low.
Error error_stops(const Image& radiance, const Image& truth) {
  constexpr double floor = 1.0 / 4096;
  std::vector<double> logs;
  logs.reserve(truth.pixels.size());
  for (std::size_t i = 0; i < truth.pixels.size(); ++i) {
    const double ratio =
        static_cast<double>(radiance.pixels[i]) / static_cast<double>(truth.pixels[i]);
    logs.push_back(std::log2(std::max(floor, ratio)));
  }
  const double median = capture::quantile_in_place(logs, 0.5);
  double squares = 0;
  for (double& log : logs) {
    log = std::abs(log - median);
    squares += log * log;
  }
  return {std::sqrt(squares / static_cast<double>(logs.size())),
          capture::quantile_in_place(logs, 0.99)};
}

// Of values with a finite deviation.
double share_within_one_deviation(const MergedFrame& frame, const Image& truth) {
  const Image deviation = frame.deviation();
  double within = 0, count = 0;
  for (std::size_t i = 0; i < truth.pixels.size(); ++i) {
    if (!std::isfinite(deviation.pixels[i])) continue;
    ++count;
    if (std::abs(frame.radiance.pixels[i] - truth.pixels[i]) <= deviation.pixels[i]) ++within;
  }
  return count > 0 ? within / count : 0;
}

// The least error in stops of any unbiased merge, where noise is small: Cramer and Rao's.
double bound_stops(const Shots& shots, const Image& truth) {
  const capture::NoiseModel noise = noise_of(shots.sensor);
  double sum = 0, count = 0;
  for (const float value : truth.pixels) {
    const auto radiance = static_cast<double>(value);
    double information = 0;
    for (const double exposure_s : shots.exposures_s) {
      const double mean = radiance * exposure_s;
      if (mean < noise.saturation) information += exposure_s * exposure_s / noise.variance(mean);
    }
    if (information == 0) continue;
    sum += 1 / (information * radiance * radiance);
    ++count;
  }
  return std::sqrt(sum / count) / std::numbers::ln2;
}

class HdrChart {
 public:
  HdrChart(const ChartRequest& request, Console& console)
      : quick_(request.quick), console_(console), side_(quick_ ? 256 : 1024) {
    console_.progress(0, "the made bracket");
    truth_ = made_scene(side_, 1);
    const std::vector<double> all(std::begin(exposures_s), std::end(exposures_s));
    coded_ = take(sensor_of(8), {truth_}, all);
    wide_ = take(sensor_of(12), {truth_}, all);
    for (int code = 0; code < 256; ++code) {
      const double light = (code - coded_.sensor.pedestal) / (255 - coded_.sensor.pedestal);
      light_of_code_.push_back(static_cast<float>(std::max(1e-5, light)));
    }
  }

  Chart measure() {
    Chart chart;
    chart.stage = "hdr";
    chart.title = "The HDR merge: error against time";
    chart.time_name = "CPU time of a frame, ms";
    chart.error_name = "RMS error, of a stop";
    chart.variant_name = "input";
    add_window(8);
    add_window(12);
    add_tables();
    add_peers();
    time_points();
    const double memory = memory_ms();
    chart.subtitle = fmt::format(
        "Made scene of {:.0f} stops, {}x{}, {} exposures. Its memory once: {:.1f} ms. Least "
        "possible error: {:.3f} stops.",
        range(), side_, side_, members, memory, bound_stops(coded_, truth_));
    for (Candidate& candidate : candidates_) {
      candidate.point.figures.emplace_back("times_memory", candidate.point.time_ms / memory);
      chart.points.push_back(std::move(candidate.point));
    }
    chart.panels.push_back({"99th percentile of the error, of a stop", {{"error_p99", ""}}});
    add_stressors(chart);
    return chart;
  }

 private:
  struct Candidate {
    ChartPoint point;
    std::function<void()> work;
    std::function<const Image&()> radiance;
  };

  double range() const {
    const auto [least, most] = std::ranges::minmax_element(truth_.pixels);
    return std::log2(static_cast<double>(*most) / static_cast<double>(*least));
  }

  void add(ChartPoint point, std::function<void()> work, std::function<const Image&()> radiance) {
    candidates_.push_back({std::move(point), std::move(work), std::move(radiance)});
  }

  static ChartPoint point_of(const std::string& method,
                             const std::string& input,
                             std::size_t shots) {
    ChartPoint p;
    p.method = method;
    p.variant = input;
    p.settings = {{"shots", static_cast<double>(shots)}, {"input", input}};
    return p;
  }

  // Ours, with and without the test for motion. A show merges floats (RollingBracket).
  void add_window(int bits) {
    const Shots& shots = bits == 8 ? coded_ : wide_;
    for (const double consistency : {capture::WindowMergeSettings{}.consistency, 0.0}) {
      for (const bool floats : {false, true}) {
        if (floats && bits == 8) continue;
        const std::string input = floats ? "floats" : fmt::format("{} bit", bits);
        ChartPoint p =
            point_of(consistency > 0 ? "window" : "window, no motion test", input, members);
        p.settings.emplace_back("consistency", consistency);
        p.by_default = consistency > 0 && floats;
        p.label = p.by_default ? "default" : "";
        const capture::WindowMergeSettings settings{.noise = noise_of(shots.sensor),
                                                    .consistency = consistency};
        add(
            std::move(p),
            [this, &shots, settings, floats, bits] {
              if (floats) return merge_window(shots.live(), settings, frame_);
              if (bits == 8) return merge_window(shots.coded8(), shots.codes(), settings, frame_);
              merge_window(shots.coded16(), shots.codes(), settings, frame_);
            },
            [this]() -> const Image& { return frame_.radiance; });
      }
    }
  }

  // The merge of files, which tells no status: `platelight hdr` makes its tables so.
  void add_tables() {
    capture::Response response;
    for (auto& channel : response.light) {
      for (int code = 0; code < capture::Response::codes; ++code) {
        channel[static_cast<std::size_t>(code)] = light_of_code(coded_.sensor, code);
      }
    }
    tables_.emplace(std::array{response_code_table(response, 0), response_code_table(response, 1),
                               response_code_table(response, 2)},
                    static_cast<int>(members));
    tables_->set_exposures(coded_.exposures_s);
    add(
        point_of("MergeTables", "8 bit", members),
        [this] {
          std::vector<const std::uint8_t*> codes;
          for (const auto& shot : coded_.bytes) codes.push_back(shot.data());
          radiance_.height = radiance_.width = side_;
          radiance_.pixels.resize(truth_.pixels.size());
          tables_->merge(codes, side_, 0, side_, radiance_.pixels.data());
        },
        [this]() -> const Image& { return radiance_; });
  }

  void add_peers() {
    for (const OpenCvMerge method : {OpenCvMerge::debevec, OpenCvMerge::robertson}) {
      ChartPoint p =
          point_of(method == OpenCvMerge::debevec ? "OpenCV MergeDebevec" : "OpenCV MergeRobertson",
                   "8 bit", members);
      p.peer = true;
      add(
          std::move(p),
          [this, method] {
            std::vector<OpenCvShot> shots;
            for (std::size_t i = 0; i < members; ++i) {
              shots.push_back({coded_.bytes[i].data(), coded_.exposures_s[i]});
            }
            merge_with_opencv(method, shots, side_, side_, light_of_code_, radiance_);
          },
          [this]() -> const Image& { return radiance_; });
    }
  }

  // In rounds, so that what else the machine does for a while slows no point alone.
  void time_points() {
    const int rounds = quick_ ? 3 : 15;
    for (int round = 0; round < rounds; ++round) {
      for (Candidate& candidate : candidates_) {
        ChartPoint& p = candidate.point;
        console_.progress(0.2 + 0.4 * round / rounds, p.method);
        const double begin_ms = cpu_ms_so_far();
        candidate.work();
        const double taken_ms = std::max(1e-3, cpu_ms_so_far() - begin_ms);
        p.time_ms = round == 0 ? taken_ms : std::min(p.time_ms, taken_ms);
        if (round > 0) continue;
        const Error error = error_stops(candidate.radiance(), truth_);
        p.error = error.rms_stops;
        p.error_p99 = error.p99_stops;
        if (&candidate.radiance() != &frame_.radiance) continue;
        p.figures.emplace_back("within_deviation", share_within_one_deviation(frame_, truth_));
      }
    }
  }

  // To read five shots of bytes, and to write radiance, status and what counts.
  double memory_ms() {
    const std::size_t samples = truth_.pixels.size();
    std::vector<std::uint8_t> written(samples * (sizeof(float) + sizeof(std::uint16_t)) +
                                      samples / 3);
    double best_ms = std::numeric_limits<double>::infinity();
    for (int round = 0; round < (quick_ ? 3 : 15); ++round) {
      const double begin_ms = cpu_ms_so_far();
      std::uint64_t sum = 0;
      for (const auto& shot : coded_.bytes) {
        for (std::size_t i = 0; i + 8 <= shot.size(); i += 8) {
          std::uint64_t word = 0;
          std::memcpy(&word, &shot[i], 8);
          sum += word;
        }
      }
      std::memset(written.data(), static_cast<int>(sum % 256), written.size());
      best_ms = std::min(best_ms, std::max(1e-3, cpu_ms_so_far() - begin_ms));
    }
    return best_ms;
  }

  // Relative error of what a window shows of the newest light, and the relative deviation that it
  // tells, as root mean squares over all channels with a deviation.
  static StressorSample judge(double value, const MergedFrame& frame, const Image& truth) {
    const Image told = frame.deviation();
    double squares = 0, reported = 0, count = 0;
    for (std::size_t i = 0; i < truth.pixels.size(); ++i) {
      const auto light = static_cast<double>(truth.pixels[i]);
      const double error = static_cast<double>(frame.radiance.pixels[i]) / light - 1;
      squares += error * error;
      if (!std::isfinite(told.pixels[i])) continue;
      const double deviation = static_cast<double>(told.pixels[i]) / light;
      reported += deviation * deviation;
      ++count;
    }
    const auto all = static_cast<double>(truth.pixels.size());
    StressorSample sample{value, std::sqrt(squares / all), std::nullopt, status_of(frame)};
    if (count > all / 2) sample.reported_error = std::sqrt(reported / count);
    return sample;
  }

  // "ok", or what more than a twentieth of the pixels are.
  static std::string status_of(const MergedFrame& frame) {
    const auto shares = frame.status_shares();
    constexpr std::array<const char*, capture::merge_status_count> names{
        "good", "dark", "inconsistent", "lower bound", "missing"};
    std::string status;
    for (std::size_t i = 1; i < shares.size(); ++i) {
      if (shares[i] < 0.05) continue;
      status += fmt::format("{}{} {:.0f} %", status.empty() ? "" : ", ", names[i], 100 * shares[i]);
    }
    return status.empty() ? "ok" : status;
  }

  int stressed_side() const { return quick_ ? 96 : 256; }

  static std::vector<double> all_exposures() {
    return {std::begin(exposures_s), std::end(exposures_s)};
  }

  static StressorSample window_sample(double value, const Shots& shots, const Image& truth) {
    return judge(value, merged(shots), truth);
  }

  void add_stressors(Chart& chart) {
    console_.progress(0.7, "what goes wrong");
    chart.stressors.push_back(light_level("light, times what the shortest exposure holds", 1, 4));
    chart.stressors.push_back(light_level("light, down to black", 1.0 / 4, -1));
    chart.stressors.push_back(missing_members(true));
    chart.stressors.push_back(missing_members(false));
    chart.stressors.push_back(changing_light());
    chart.stressors.push_back(wrong_label());
    chart.stressors.push_back(flicker(false));
    chart.stressors.push_back(flicker(true));
    chart.stressors.push_back(rolling_flicker());
    chart.stressors.push_back(bent_response());
  }

  Stressor light_level(const std::string& name, double first, int direction) {
    Stressor stressor{name, "", true, {}};
    for (int step = 0; step <= 6; ++step) {
      const double light = first * std::exp2((direction > 0 ? 2.0 : -2.5) * step);
      const Image truth = made_scene(stressed_side(), light);
      stressor.samples.push_back(
          window_sample(light, take(sensor_of(12), {truth}, all_exposures()), truth));
    }
    std::ranges::sort(stressor.samples, {}, &StressorSample::value);
    return stressor;
  }

  Stressor missing_members(bool longest) {
    Stressor stressor{
        fmt::format("members missing, the {} first", longest ? "longest" : "shortest"),
        "",
        false,
        {}};
    const Image truth = made_scene(stressed_side(), 1);
    for (std::size_t missing = 0; missing < members; ++missing) {
      std::vector<double> left = all_exposures();
      for (std::size_t i = 0; i < missing; ++i) {
        left.erase(longest ? std::ranges::max_element(left) : std::ranges::min_element(left));
      }
      stressor.samples.push_back(
          window_sample(static_cast<double>(missing), take(sensor_of(12), {truth}, left), truth));
    }
    return stressor;
  }

  Stressor changing_light() {
    Stressor stressor{"light, times that of the frame before", "", true, {}};
    for (const double factor : {1.001, 1.003, 1.01, 1.03, 1.1, 1.3, 2.0, 4.0}) {
      std::vector<Image> scenes;
      for (std::size_t i = 0; i < members; ++i) {
        const auto before = static_cast<double>(members - 1 - i);
        scenes.push_back(made_scene(stressed_side(), 0.25 * std::pow(factor, -before)));
      }
      stressor.samples.push_back(
          window_sample(factor, take(sensor_of(12), scenes, all_exposures()), scenes.back()));
    }
    return stressor;
  }

  // Lamps at 100 Hz, before exposures far shorter than their period, 60 times a second.
  Stressor flicker(bool levelled) {
    Stressor stressor{
        fmt::format("flicker of lamps, modulation{}", levelled ? ", levelled" : ""), "", true, {}};
    for (const double modulation : {0.05, 0.1, 0.2, 0.4, 0.6, 0.8}) {
      std::vector<Image> scenes;
      double logs = 0;
      for (std::size_t i = 0; i < members; ++i) {
        const double phase = 2 * std::numbers::pi * 100 / 60 * static_cast<double>(i) + 0.3;
        const double factor = 0.5 * (1 + modulation * std::sin(phase));
        logs += std::log(factor);
        scenes.push_back(made_scene(stressed_side(), factor));
      }
      const Image truth = made_scene(stressed_side(), std::exp(logs / members));
      const Shots shots = take(sensor_of(12), scenes, all_exposures());
      stressor.samples.push_back(judge(modulation, merged(shots, levelled), truth));
    }
    return stressor;
  }

  // The same before a rolling shutter: bands, as rows are taken one after the other.
  Stressor rolling_flicker() {
    Stressor stressor{"flicker of lamps before a rolling shutter, modulation", "", true, {}};
    const Image even = made_scene(stressed_side(), 0.5);
    for (const double modulation : {0.01, 0.05, 0.1, 0.2, 0.4, 0.6}) {
      std::vector<Image> scenes(members, even);
      Image truth = even;
      for (int y = 0; y < even.height; ++y) {
        double logs = 0;
        for (std::size_t i = 0; i < members; ++i) {
          const double frames = static_cast<double>(i) + static_cast<double>(y) / even.height;
          const double factor = 1 + modulation * std::sin(2 * std::numbers::pi * 100 / 60 * frames);
          logs += std::log(factor);
          scale_row(scenes[i], y, factor);
        }
        scale_row(truth, y, std::exp(logs / members));
      }
      stressor.samples.push_back(
          window_sample(modulation, take(sensor_of(12), scenes, all_exposures()), truth));
    }
    return stressor;
  }

  static void scale_row(Image& image, int y, double factor) {
    const std::size_t row = static_cast<std::size_t>(image.width) * 3;
    const auto begin = image.pixels.begin() + static_cast<std::ptrdiff_t>(row) * y;
    std::for_each(begin, begin + static_cast<std::ptrdiff_t>(row),
                  [&](float& value) { value *= static_cast<float>(factor); });
  }

  // The newest exposure but one says another time than it had.
  Stressor wrong_label() {
    Stressor stressor{"label of one exposure, times the true one", "", true, {}};
    const Image truth = made_scene(stressed_side(), 1);
    for (const double factor : {1.003, 1.01, 1.03, 1.1, 1.3, 2.0, 4.0}) {
      Shots shots = take(sensor_of(12), {truth}, all_exposures());
      shots.exposures_s[members - 2] *= factor;
      stressor.samples.push_back(window_sample(factor, shots, truth));
    }
    return stressor;
  }

  // Codes with a wave on them; from 0.17 of the range on, some light has a lower code than less
  // light.
  Stressor bent_response() {
    Stressor stressor{"wave on the response, of the range", "", true, {}};
    const Image truth = made_scene(stressed_side(), 1);
    for (const double wave : {0.001, 0.003, 0.01, 0.03, 0.1, 0.3}) {
      Shots shots = take(sensor_of(12), {truth}, all_exposures());
      for (capture::MadeShot& shot : shots.taken) {
        for (std::uint16_t& code : shot.codes) {
          const double value =
              (code - shots.sensor.pedestal) / (shots.white() - shots.sensor.pedestal);
          const double bent = value + wave * std::sin(2 * std::numbers::pi * value);
          const double seen =
              std::round(shots.sensor.pedestal + bent * (shots.white() - shots.sensor.pedestal));
          code = static_cast<std::uint16_t>(std::clamp(seen, 0.0, shots.white()));
        }
      }
      stressor.samples.push_back(window_sample(wave, shots, truth));
    }
    return stressor;
  }

  bool quick_;
  Console& console_;
  int side_;
  Image truth_;
  Shots coded_, wide_;
  std::vector<float> light_of_code_;
  std::optional<capture::MergeTables> tables_;
  std::vector<Candidate> candidates_;
  MergedFrame frame_;
  Image radiance_;
};

}  // namespace

ChartStage hdr_chart() {
  return {"hdr", "the HDR merge: inputs, motion test, OpenCV's merges",
          [](const ChartRequest& request, Console& console) {
            return HdrChart(request, console).measure();
          }};
}

}  // namespace studio
