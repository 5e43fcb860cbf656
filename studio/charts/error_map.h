// Where a picture errs, as pictures.
#pragma once

#include <string>
#include <vector>

#include "capture/image.h"
#include "render/group_error.h"

namespace studio {

// The groups that err most, the worst first: at most `most` of them.
std::vector<render::GroupError> worst_groups(std::vector<render::GroupError> groups,
                                             std::size_t most);

// Writes PATH_START.png, the picture (height, width, 4) as a display shows it, each pixel twice as
// large, its eight worst groups framed; and PATH_START_error.png, a map of the groups' errors of
// the mean in classes of colour, with their legend. Throws std::runtime_error naming the file that
// cannot be written.
void write_error_map(const std::string& path_start,
                     const std::string& title,
                     const capture::Image& picture,
                     const std::vector<render::GroupError>& groups);

}  // namespace studio
