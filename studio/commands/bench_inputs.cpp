// platelight bench inputs: what a show spends on a frame before it is rendered.
#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "studio/commands/benches.h"
#include "studio/frame_maker.h"
#include "studio/machine.h"

namespace studio {
namespace {

struct Pass {
  int frames = 0;
  double cpu_ms = 0;                      // a frame
  std::array<double, stages> stage_ms{};  // a frame, by the clock
};

// The frames of a set, without the first, which builds what is kept.
Pass make_all(const Set& set, std::int64_t most_frames) {
  FrameMaker maker(set);
  const auto make = [&](std::int64_t number) {
    return maker.plate().is_live() ? maker.make_at(maker.wait_for_plate()) : maker.make(number);
  };
  make(0);
  Pass pass;
  const double start_ms = cpu_ms_so_far();
  while (const std::optional<PreparedFrame> frame = make(pass.frames + 1)) {
    for (std::size_t i = 0; i < stages; ++i) pass.stage_ms[i] += frame->stage_ms[i];
    ++pass.frames;
    if (pass.frames + 1 >= std::min(most_frames, set.show.frames.value_or(most_frames))) break;
  }
  const double frames = std::max(pass.frames, 1);
  pass.cpu_ms = (cpu_ms_so_far() - start_ms) / frames;
  for (double& ms : pass.stage_ms) ms /= frames;
  return pass;
}

}  // namespace

void bench_inputs(const std::string& set_path,
                  int runs,
                  std::int64_t most_frames,
                  Console& console) {
  const Set set = read_set(set_path);
  Pass best = make_all(set, most_frames);
  for (int i = 1; i < runs; ++i) {
    const Pass pass = make_all(set, most_frames);
    if (pass.cpu_ms < best.cpu_ms) best = pass;
  }
  nlohmann::ordered_json stage_ms;
  std::string parts;
  for (const Stage stage : {Stage::capture, Stage::probe, Stage::job}) {
    const double ms = best.stage_ms[static_cast<std::size_t>(stage)];
    stage_ms[std::string(name_of(stage))] = ms;
    parts += fmt::format("  {} {:.2f} ms", name_of(stage), ms);
  }
  console.say(fmt::format("{} frames of {}: {:.2f} ms of CPU time a frame; by the clock{}",
                          best.frames, set_path, best.cpu_ms, parts));
  const Machine machine = this_machine();
  console.figures(nlohmann::ordered_json{
      {"set", set_path},
      {"frames", best.frames},
      {"cpu_ms", best.cpu_ms},
      {"stage_ms", stage_ms},
      {"machine", {{"cpu", machine.cpu}, {"threads", machine.threads}, {"arch", machine.arch}}}}
                      .dump(2));
}

}  // namespace studio
