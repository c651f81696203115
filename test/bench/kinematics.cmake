# Forward kinematics: generated C and the library beside KDL and MuJoCo.
find_path(KDL_INCLUDE_DIR kdl/tree.hpp)
find_library(KDL_LIBRARY orocos-kdl)
find_path(MUJOCO_INCLUDE_DIR mujoco/mujoco.h)
find_library(MUJOCO_LIBRARY mujoco)
if(NOT (KDL_INCLUDE_DIR AND KDL_LIBRARY AND MUJOCO_INCLUDE_DIR AND MUJOCO_LIBRARY))
  message(STATUS "Orocos KDL or MuJoCo not found: kinematics_bench is left out")
  return()
endif()

set(generated ${CMAKE_CURRENT_BINARY_DIR}/kinematics)
file(MAKE_DIRECTORY ${generated})
add_custom_command(
  OUTPUT ${generated}/quadruped.c ${generated}/quadruped.h
  COMMAND morphbus export ${CMAKE_SOURCE_DIR}/models/mtran.m3l --robot quadruped --to c
          -o ${generated}/quadruped.c
  DEPENDS morphbus ${CMAKE_SOURCE_DIR}/models/mtran.m3l
  VERBATIM)
add_library(morphbus_quadruped_kinematics STATIC ${generated}/quadruped.c)
target_compile_options(morphbus_quadruped_kinematics PRIVATE -O3)
target_include_directories(morphbus_quadruped_kinematics PUBLIC ${generated})
target_link_libraries(morphbus_quadruped_kinematics PUBLIC m)

morphbus_executable(kinematics_bench
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/kinematics_bench.cc
  DEPS morphbus_quadruped_kinematics morphbus_emit morphbus_test_compiled benchmark::benchmark
       ${KDL_LIBRARY} ${MUJOCO_LIBRARY})
target_include_directories(kinematics_bench SYSTEM PRIVATE ${KDL_INCLUDE_DIR} ${MUJOCO_INCLUDE_DIR})
