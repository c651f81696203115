# Physics: the simulated quadruped standing, beside a bare Bullet loop over the same bodies.
morphbus_executable(sim_bench
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/sim_bench.cc
  DEPS morphbus_test_sim morphbus_bullet benchmark::benchmark)
