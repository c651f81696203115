# Tests of the VM core, and the harness that runs whole robots of VMs in one process.
morphbus_library(morphbus_test_vm_robot
  SOURCES
    ${CMAKE_SOURCE_DIR}/test/support/toy_model.cc
    ${CMAKE_SOURCE_DIR}/test/support/vm_robot.cc
  DEPS morphbus_model morphbus_vm_core morphbus_vm_encode)

morphbus_test(vm_core_test
  SOURCES
    bodies_test.cc
    kinematics_image_test.cc
    pose_test.cc
    program_relay_test.cc
    spatial_test.cc
  DEPS morphbus_test_vm_robot
  LABELS fast)
