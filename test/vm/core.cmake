# Tests of the VM core, and the harness that runs whole robots of VMs in one process.
morphbus_library(morphbus_test_vm_robot
  SOURCES
    ${CMAKE_SOURCE_DIR}/test/support/toy_model.cc
    ${CMAKE_SOURCE_DIR}/test/support/vm_robot.cc
  DEPS morphbus_emit morphbus_model morphbus_vm_core morphbus_vm_encode)

# Models and programs from their sources.
morphbus_library(morphbus_test_compiled
  SOURCES ${CMAKE_SOURCE_DIR}/test/support/compiled.cc
  DEPS morphbus_dynarole morphbus_m3l)
target_compile_definitions(morphbus_test_compiled PRIVATE MORPHBUS_SOURCE_DIR="${CMAKE_SOURCE_DIR}")

morphbus_test(vm_core_test
  SOURCES
    bodies_test.cc
    kinematics_image_test.cc
    pose_test.cc
    program_relay_test.cc
    spatial_test.cc
  DEPS morphbus_test_vm_robot
  LABELS fast)

morphbus_test(vm_robot_test
  SOURCES
    diffusion_test.cc
    quadruped_test.cc
    roles_test.cc
    state_test.cc
    tasks_test.cc
  DEPS morphbus_test_compiled morphbus_test_vm_robot
  LABELS fast)

get_target_property(core_sources morphbus_vm_core SOURCES)
get_target_property(program_sources morphbus_vm_program SOURCES)
list(JOIN core_sources "," core_sources)
list(JOIN program_sources "," program_sources)
add_test(NAME vm_core.NeedsNoHeapExceptionsOrLibrary
  COMMAND ${CMAKE_COMMAND} -D COMPILER=${CMAKE_CXX_COMPILER} -D NM=${CMAKE_NM}
          -D SOURCE_DIR=${CMAKE_SOURCE_DIR} -D WORK_DIR=${CMAKE_CURRENT_BINARY_DIR}/freestanding
          -D "SOURCES=${core_sources},${program_sources}"
          -P ${CMAKE_CURRENT_SOURCE_DIR}/freestanding_check.cmake)
set_tests_properties(vm_core.NeedsNoHeapExceptionsOrLibrary PROPERTIES TIMEOUT 180 LABELS fast)
