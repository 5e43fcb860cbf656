// Scripts of rehearsals: what a show does at which of its frames. studio/docs/live_show.md has the
// file's keys.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "studio/frame_maker.h"
#include "studio/recording.h"
#include "studio/set.h"
#include "studio/set_scene.h"
#include "studio/show.h"

namespace studio {

// Reads a script for a show of the set; `adapt` is done to every other set that it changes to.
// Moves that take several frames become one command for each. Throws SetError with every fault that
// the file and the sets show: of syntax, keys, ranges, names and files that are not there, of
// commands that could not be carried out by then.
Script read_script(const std::string& path,
                   const Set& set,
                   const std::function<void(Set&)>& adapt = {});

// Where a show of nothing that ends by itself ends: with its script's last frame. Nothing if there
// is no script.
std::optional<std::int64_t> end_of(const Script& script);

// Opens what a script needs, but for devices, and lets it go again. Throws SetError with what is
// wrong with videos, recordings, models of the sets that it changes to, and names of parts.
// `scene`: of the set. `recording`: of the show, before anything is recorded.
void check_script(const Script& script,
                  const Set& set,
                  const SetScene& scene,
                  const Recording& recording);

// Tells a show's scene what the script is going to move, for the first move of anything costs as
// much as building its trees. Nothing stands elsewhere after it.
void hold_apart(const Script& script, FrameMaker& maker);

}  // namespace studio
