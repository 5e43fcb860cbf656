// The papers' scenes as shots to measure with.
#pragma once

#include <array>
#include <string_view>

#include "render/paper_scenes.h"
#include "studio/bench_scene.h"

namespace studio {

struct PaperShot {
  BenchScene shot;        // with lights, followed as in a show: compact sources apart; plate black
  double compile_ms = 0;  // that Embree's trees took
};

// Throws std::invalid_argument as render::made_paper_scene.
PaperShot make_paper_shot(std::string_view name, int width, int height);
// The same of a scene that has been changed; a screen that lights it is columns x rows lamps.
PaperShot make_paper_shot(render::PaperScene paper,
                          int width,
                          int height,
                          std::array<int, 2> screen_lamps = {5, 5});

}  // namespace studio
