// platelight chart: measures what settings cost and what they buy.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "compositing/output_file.h"
#include "studio/chart_stages.h"
#include "studio/charts/set.h"
#include "studio/commands/commands.h"
#include "studio/effort_points.h"
#include "studio/set.h"

namespace studio {
namespace {

struct ChartOptions {
  std::vector<std::string> stages;
  std::string out;  // "" = here; of a set, beside its file
  ChartRequest request;
  std::optional<std::int64_t> samples;
};

// Before hours of measuring. Throws std::runtime_error if it cannot be had.
void require_chart_folder(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  compositing::require_writable_folder(folder);
}

// "set SET.toml": beside the set file, where `run` looks for it, if nothing else is said.
void chart_of_set(const ChartOptions& options, Console& console) {
  if (options.stages.size() != 2) throw UsageError("chart set needs one set file: set SET.toml");
  if (!options.request.set.empty()) {
    throw UsageError("chart set measures the set that is named after it: --set is for photograph");
  }
  const std::string& set = options.stages[1];
  const std::string beside = std::filesystem::path(effort_points_file(set)).parent_path().string();
  const std::string out = !options.out.empty() ? options.out : beside.empty() ? "." : beside;
  static_cast<void>(read_set(set));  // no folder is made for a set that is none
  require_chart_folder(out);
  SetChartSettings settings;
  settings.quick = options.request.quick;
  if (options.samples) settings.samples = static_cast<int>(*options.samples);
  Chart measured = chart_set(set, settings, console);
  mark_front(measured);
  write_chart(measured, out);
  console.figures(chart_json(measured));
  console.say(fmt::format("{0}/{1}.svg, .png, .csv, .json", out, measured.stage));
}

void chart(const ChartOptions& options, Console& console) {
  if (!options.stages.empty() && options.stages[0] == "set") return chart_of_set(options, console);
  const bool all = options.stages == std::vector<std::string>{"all"};
  std::vector<const ChartStage*> wanted;
  for (const ChartStage& stage : chart_stages()) {
    if (all || std::ranges::find(options.stages, stage.name) != options.stages.end()) {
      wanted.push_back(&stage);
    }
  }
  if (!all && std::ranges::find(options.stages, "all") != options.stages.end())
    throw UsageError("all stands alone: it is every stage");
  for (const std::string& name : options.stages) {
    if (all || std::ranges::find(chart_stages(), name, &ChartStage::name) != chart_stages().end()) {
      continue;
    }
    std::string known;
    for (const ChartStage& stage : chart_stages()) known += fmt::format(" {},", stage.name);
    known += " set SET.toml,";
    throw UsageError(fmt::format("there is no chart of \"{}\": there are{} all", name, known));
  }
  if (options.samples) throw UsageError("--samples is for chart set SET.toml");
  for (const ChartStage* stage : wanted) {
    if (all || options.request.set.empty() || stage->takes_set) continue;
    throw UsageError(fmt::format(
        "chart {} measures made scenes alone: --set is for photograph; a whole set is measured by "
        "chart set SET.toml",
        stage->name));
  }
  if (wanted.size() > 1 && console.wants_figures()) {
    throw UsageError("--json takes the figures of one stage; --out has them all");
  }
  const std::string out = options.out.empty() ? "." : options.out;
  require_chart_folder(out);
  ChartRequest request = options.request;
  request.out = out;
  for (const ChartStage* stage : wanted) {
    Chart measured = stage->measure(request, console);
    mark_front(measured);
    write_chart(measured, out);
    console.figures(chart_json(measured));
    console.say(fmt::format("{0}/{1}.svg, .png, .csv, .json", out, measured.stage));
  }
}

}  // namespace

Command chart_command() {
  return {
      "chart", "Measure error against time over the settings of a stage",
      "platelight chart lights --out charts/",
      [](Arguments& arguments) -> std::function<void(Console&)> {
        auto o = std::make_shared<ChartOptions>();
        std::string stages = "what to measure: all, or some of";
        for (const ChartStage& stage : chart_stages()) {
          stages += fmt::format("\n{} ({})", stage.name, stage.summary);
        }
        stages += "\nset SET.toml (a whole set on this machine, for run --fps and --error)";
        arguments.positionals("STAGE", o->stages, stages);
        arguments.option("--out", o->out,
                         "directory that the charts are written to (this one; of a set, its own)");
        arguments.option("--set", o->request.set, "photograph: measure with this set file's scene");
        arguments.option("--samples", o->samples, 2, 1 << 20,
                         "set: of the reference, paths per pixel (256)");
        arguments.flag("--quick", o->request.quick, "fewer points, for a first look");
        return [o](Console& console) { chart(*o, console); };
      }};
}

}  // namespace studio
