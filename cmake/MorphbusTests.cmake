# What only the tests and benchmarks need; who wants to build and run needs none of it (tools/setup --run).

# morphbus_left_out(TEXT): says what is not tested for want of a package, or fails if everything must be (tools/check).
function(morphbus_left_out text)
  if(MORPHBUS_ALL_TESTS)
    message(FATAL_ERROR "${text}. MORPHBUS_ALL_TESTS asks for it; tools/setup installs it.")
  endif()
  message(STATUS "${text}")
endfunction()

find_package(GTest QUIET)
if(NOT GTest_FOUND)
  morphbus_left_out("GoogleTest (libgtest-dev) not found: the tests and benchmarks are left out")
endif()
find_package(benchmark QUIET)
if(NOT benchmark_FOUND AND MORPHBUS_BENCH)
  morphbus_left_out("Google Benchmark (libbenchmark-dev) not found: the benchmarks are left out")
endif()
