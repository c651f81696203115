# Logs: writing, reading (LCM's own reader beside ours), loading, comparing.
morphbus_executable(log_bench
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/log_bench.cc
  DEPS morphbus_test_synthetic_log morphbus_lcm benchmark::benchmark)
