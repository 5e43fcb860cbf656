// Solvers that do not write to the terminal.
#pragma once

namespace calibrate {

// Ceres writes to stderr through glog, even of a step that it then makes shorter; from now on only
// what ends the program. Cheap to call again.
void keep_ceres_quiet();

}  // namespace calibrate
