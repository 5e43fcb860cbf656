// The papers' scenes as shots to measure with.
#pragma once

#include <string_view>

#include "studio/bench_scene.h"

namespace studio {

struct PaperShot {
  BenchScene shot;        // with lights, followed as in a show: compact sources apart; plate black
  double compile_ms = 0;  // that Embree's trees took
};

// Throws std::invalid_argument as render::made_paper_scene.
PaperShot make_paper_shot(std::string_view name, int width, int height);

}  // namespace studio
