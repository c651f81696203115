# Assemblies of thousands of modules: time over size, and congruence.
morphbus_executable(scale_bench
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/scale_bench.cc
  DEPS morphbus_test_large_robots morphbus_m3l morphbus_congruence benchmark::benchmark)
target_compile_definitions(scale_bench PRIVATE MORPHBUS_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
