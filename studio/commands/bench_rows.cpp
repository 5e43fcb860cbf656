// Rows as figures.
#include "studio/commands/bench_rows.h"

#include "studio/json_text.h"
#include "studio/machine.h"

namespace studio {

void give_rows(const nlohmann::ordered_json& rows, Console& console) {
  const Machine machine = this_machine();
  const nlohmann::ordered_json figures{
      {"rows", rows},
      {"machine", {{"cpu", machine.cpu}, {"threads", machine.threads}, {"arch", machine.arch}}}};
  console.figures(json_text(figures));
}

}  // namespace studio
