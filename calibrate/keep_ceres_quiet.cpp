// Solvers that do not write to the terminal.
#include "calibrate/keep_ceres_quiet.h"

#include <glog/logging.h>

namespace calibrate {

void keep_ceres_quiet() {
  static const bool once = [] {
    FLAGS_minloglevel = google::GLOG_FATAL;
    return true;
  }();
  static_cast<void>(once);
}

}  // namespace calibrate
