// platelight chart: measures what settings cost and what they buy.
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "studio/chart_stages.h"
#include "studio/commands/commands.h"

namespace studio {
namespace {

struct ChartOptions {
  std::vector<std::string> stages;
  std::string out = ".";
  ChartRequest request;
};

void chart(const ChartOptions& options, Console& console) {
  const bool all = options.stages == std::vector<std::string>{"all"};
  std::vector<const ChartStage*> wanted;
  for (const ChartStage& stage : chart_stages()) {
    if (all || std::ranges::find(options.stages, stage.name) != options.stages.end()) {
      wanted.push_back(&stage);
    }
  }
  for (const std::string& name : options.stages) {
    if (all || std::ranges::find(chart_stages(), name, &ChartStage::name) != chart_stages().end()) {
      continue;
    }
    std::string known;
    for (const ChartStage& stage : chart_stages()) known += fmt::format(" {},", stage.name);
    throw UsageError(fmt::format("there is no chart of \"{}\": there are{} all", name, known));
  }
  if (wanted.size() > 1 && console.wants_figures()) {
    throw UsageError("--json takes the figures of one stage; --out has them all");
  }
  for (const ChartStage* stage : wanted) {
    Chart measured = stage->measure(options.request, console);
    mark_front(measured);
    write_chart(measured, options.out);
    console.figures(chart_json(measured));
    console.say(fmt::format("{0}/{1}.svg, .png, .csv, .json", options.out, measured.stage));
  }
}

}  // namespace

Command chart_command() {
  return {"chart", "Measure error against time over the settings of a stage",
          "platelight chart lights --out charts/",
          [](Arguments& arguments) -> std::function<void(Console&)> {
            auto o = std::make_shared<ChartOptions>();
            std::string stages = "what to measure: all, or some of";
            for (const ChartStage& stage : chart_stages()) {
              stages += fmt::format("\n{} ({})", stage.name, stage.summary);
            }
            arguments.positionals("STAGE", o->stages, stages);
            arguments.option("--out", o->out, "directory that the charts are written to");
            arguments.option("--set", o->request.set, "measure with this set file's scene");
            arguments.flag("--quick", o->request.quick, "fewer points, for a first look");
            return [o](Console& console) { chart(*o, console); };
          }};
}

}  // namespace studio
