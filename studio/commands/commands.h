// What each command's file offers to the table.
#pragma once

#include "studio/command.h"

namespace studio {

Command bench_command();
Command key_command();
Command calibrate_board_command();
Command calibrate_light_command();
Command calibrate_lines_command();
Command calibrate_offset_command();
Command calibrate_lens_command();
Command calibrate_pose_command();
Command calibrate_probe_command();
Command calibrate_response_command();
Command calibrate_rig_command();
Command calibrate_vignetting_command();
Command capture_command();
Command chart_command();
Command check_command();
Command demo_command();
Command devices_command();
Command hdr_command();
Command run_command();
Command still_command();

}  // namespace studio
