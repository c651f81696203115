# The connection solver on real modules and on modules with many points.
morphbus_executable(solver_bench
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/solver_bench.cc
  DEPS morphbus_known_modules benchmark::benchmark)
