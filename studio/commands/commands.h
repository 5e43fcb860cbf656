// What each command's file offers to the table.
#pragma once

#include "studio/command.h"

namespace studio {

Command check_command();

}  // namespace studio
