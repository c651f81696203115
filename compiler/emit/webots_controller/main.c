/* Holds each joint where it starts. Written by morphbus export: copy it before you make it your own. */
#include "morphbus_module.h"

int main(void) {
  int joint;
  module_start(0);
  if (!module_step()) return 0; /* Sensors have values from the first step on. */
  for (joint = 0; joint < NUM_JOINTS; ++joint) module_command_joint(joint, MODULE_HOLD, 0, 0);
  while (module_step()) continue;
  return 0;
}
