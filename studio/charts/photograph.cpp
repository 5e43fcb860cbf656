// The headline chart.
#include "studio/charts/photograph.h"

#include <unistd.h>

#include <filesystem>

#include <fmt/format.h>

#include "studio/photograph_trial.h"

namespace studio {
namespace {

namespace fs = std::filesystem;

// What a lens and pose that were solved with care still leave: half a pixel.
constexpr double calibration_error_px = 0.5;

// The program's own footage, for as long as the chart needs it.
class TemporaryCourt {
 public:
  TemporaryCourt(bool quick, const DemoProgress& progress)
      : dir_(fs::temp_directory_path() / fmt::format("platelight_photograph_{}", getpid())) {
    DemoSettings settings;
    settings.dir = dir_;
    settings.studio.frames = 1;
    if (quick) {
      settings.studio = {.width = 96,
                         .height = 72,
                         .probe_size = 96,
                         .sky_height = 128,
                         .texture_size = 256,
                         .frames = 1};
    }
    set_ = write_demo(settings, progress).set;
  }
  ~TemporaryCourt() {
    std::error_code ignored;
    fs::remove_all(dir_, ignored);
  }
  TemporaryCourt(const TemporaryCourt&) = delete;
  TemporaryCourt& operator=(const TemporaryCourt&) = delete;

  std::string set() const { return set_.string(); }

 private:
  fs::path dir_, set_;
};

// A composite to be measured.
struct Step {
  std::string name;
  Truths truths;
};

// One thing true, all else as the program has it.
const std::vector<Step> one_at_a_time{{"as it runs", {}},
                                      {"plate true", {.plate = true}},
                                      {"light true", {.light = true}},
                                      {"matte true", {.matte = true}},
                                      {"sampling true", {.sampling = true}}};

// One thing more true from step to step.
std::vector<Step> one_after_the_other() {
  std::vector<Step> steps{{fmt::format("{} px off", calibration_error_px), {}}};
  Truths truths;
  const auto add = [&](const char* name, bool Truths::*truth) {
    truths.*truth = true;
    steps.push_back({name, truths});
  };
  add("+ calibration", &Truths::calibration);
  add("+ plate", &Truths::plate);
  add("+ light", &Truths::light);
  add("+ matte", &Truths::matte);
  add("+ sampling", &Truths::sampling);
  add("+ bounces", &Truths::bounces);
  return steps;
}

class PhotographChart {
 public:
  PhotographChart(const ChartRequest& request, Console& console)
      : quick_(request.quick),
        console_(console),
        trial_(set_of(request),
               {.photograph_samples = quick_ ? 16 : 64, .reference_samples = quick_ ? 16 : 64},
               [&](double share, std::string_view what) {
                 console_.progress(0.2 + 0.4 * share, what);
               }) {
    court_.reset();
  }

  Chart measure() {
    Chart chart;
    chart.stage = "photograph";
    chart.title = "The composite against its photograph";
    const capture::Image& picture = trial_.photograph();
    chart.subtitle = fmt::format("{}, {}x{}, {} triangles, {:.0f} % of the picture affected", name_,
                                 picture.width, picture.height, trial_.triangles(),
                                 100 * trial_.affected_share());
    chart.time_name = "time of the picture, ms";
    chart.error_name = "relative RMS error against the photograph";
    add_steps(chart, {"one thing true", "one thing true, all else as it runs", false, 0},
              one_at_a_time);
    add_steps(chart,
              {"one thing more true", "true one after the other", true, calibration_error_px},
              one_after_the_other());
    chart.stressors.push_back(calibration());
    return chart;
  }

 private:
  std::string set_of(const ChartRequest& request) {
    if (!request.set.empty()) {
      name_ = read_set(request.set).name;
      return request.set;
    }
    court_.emplace(
        quick_, [&](double share, std::string_view what) { console_.progress(0.2 * share, what); });
    name_ = "made car on the court";
    return court_->set();
  }

  struct Split {
    std::string method;
    std::string title;
    bool keeps = false;  // what one step makes true stays so in the next
    double calibration_error_px = 0;
  };

  void add_steps(Chart& chart, const Split& split, const std::vector<Step>& steps) {
    ErrorSteps bars{split.title, {}};
    std::vector<double> squares;
    for (const Step& step : steps) {
      console_.progress(0.6 + 0.025 * done_++, step.name);
      const double error_px = step.truths.calibration ? 0 : split.calibration_error_px;
      const TrialResult result = trial_.measure(step.truths, error_px);
      const render::PairedError& error = result.error;
      bars.steps.push_back({step.name, error.relative_rms, error.standard_error});
      squares.push_back(error.square);
      ChartPoint p = point(step, error_px, result);
      p.method = split.method;
      if (squares.size() > 1) {
        const std::vector<double> parts = split.keeps
                                              ? parts_of_square(squares)
                                              : parts_of_square({squares.front(), squares.back()});
        p.figures.emplace_back("part_of_square", parts.back());
      }
      chart.points.push_back(std::move(p));
    }
    chart.steps.push_back(std::move(bars));
  }

  static ChartPoint point(const Step& step, double error_px, const TrialResult& result) {
    const Truths& truths = step.truths;
    ChartPoint p;
    p.label = step.name;
    p.settings = {{"calibration_error_px", error_px}, {"plate_true", truths.plate},
                  {"light_true", truths.light},       {"matte_true", truths.matte},
                  {"sampling_true", truths.sampling}, {"bounces_true", truths.bounces}};
    p.time_ms = result.time_ms;
    p.error = result.error.relative_rms;
    p.error_p99 = result.error_p99;
    p.figures = {{"standard_error", result.error.standard_error}};
    return p;
  }

  Stressor calibration() {
    Stressor stressor{"camera turned by so much, right and down", "pixels", true, {}};
    for (const double px : quick_ ? std::vector{1.0} : std::vector{0.1, 0.2, 0.5, 1.0, 2.0, 5.0}) {
      console_.progress(0.95, "calibration");
      stressor.samples.push_back({px, trial_.measure({}, px).error.relative_rms, {}, "ok"});
    }
    return stressor;
  }

  bool quick_;
  Console& console_;
  std::string name_;
  std::optional<TemporaryCourt> court_;
  PhotographTrial trial_;
  int done_ = 0;
};

}  // namespace

ChartStage photograph_chart() {
  return {"photograph",
          "the composite against the photograph of the same world, split by its causes",
          [](const ChartRequest& request, Console& console) {
            return PhotographChart(request, console).measure();
          },
          true};
}

}  // namespace studio
