# The same bits on every machine (docs/arithmetic.md). Each operation rounds as it stands in the source: none is contracted
# with the next one where the processor could. Eigen would add the parts of a sum in the order that the processor's
# registers suggest, and contract by intrinsics on arm64: without vectors it computes as it is written. tools/lint/arithmetic
# asks every compile command.
add_compile_options(-ffp-contract=off)
add_compile_definitions(EIGEN_DONT_VECTORIZE)
# clang computes functions of constants with the libm of the machine that it runs on; GCC rounds them correctly, as
# compiler/elementary does.
set(MORPHBUS_ELEMENTARY sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp exp2 expm1 log log2 log10 log1p pow
    hypot cbrt)
foreach(function ${MORPHBUS_ELEMENTARY})
  add_compile_options($<$<CXX_COMPILER_ID:Clang>:-fno-builtin-${function}> $<$<CXX_COMPILER_ID:Clang>:-fno-builtin-${function}f>)
endforeach()

# Warnings and sanitizers live on interface targets; nothing else is set globally.
add_library(morphbus_warnings INTERFACE)
target_compile_options(morphbus_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wold-style-cast -Wcast-align
  -Woverloaded-virtual -Wnull-dereference -Wformat=2 -Wimplicit-fallthrough)
if(MORPHBUS_WERROR)
  target_compile_options(morphbus_warnings INTERFACE -Werror)
endif()

# GCC stops now and then to collect its garbage, which takes a tenth of its time and is not worth it for
# files of this size.
target_compile_options(morphbus_warnings INTERFACE
  $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-expand=1000> $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=2000000>)

# Half of a sanitized build is the tests' own sources, which take twice as long with instructions that look after them. What
# they test has these, and a test that is wrong itself shows in --all, which looks after all.
option(MORPHBUS_TESTS_SANITIZED "Under AddressSanitizer the tests' own sources are instrumented, too" OFF)

# morphbus_without_instructions(TARGET SOURCES a.cc ...): for the tests' own sources, unless there are others among them.
function(morphbus_without_instructions target)
  cmake_parse_arguments(ARG "" "" "SOURCES" ${ARGN})
  string(REPLACE "${CMAKE_SOURCE_DIR}/test/" "" sources "${ARG_SOURCES}")
  if(MORPHBUS_SANITIZE MATCHES "address" AND NOT MORPHBUS_FUZZ AND NOT MORPHBUS_TESTS_SANITIZED
     AND NOT "${sources}" MATCHES "\\.\\./|${CMAKE_SOURCE_DIR}/")
    set_target_properties(${target} PROPERTIES MORPHBUS_NOT_SANITIZED ON)
  endif()
endfunction()

add_library(morphbus_sanitize INTERFACE)
if(MORPHBUS_SANITIZE)
  target_compile_options(morphbus_sanitize INTERFACE -fno-omit-frame-pointer
    "$<$<NOT:$<BOOL:$<TARGET_PROPERTY:MORPHBUS_NOT_SANITIZED>>>:-fsanitize=${MORPHBUS_SANITIZE};-fno-sanitize-recover=all>")
  target_link_options(morphbus_sanitize INTERFACE -fsanitize=${MORPHBUS_SANITIZE})
  if(MORPHBUS_SANITIZE MATCHES "address" AND NOT MORPHBUS_FUZZ)
    # Sanitized programs are large; gold links them twice as fast as bfd, and mold five times.
    include(CheckLinkerFlag)
    check_linker_flag(CXX -fuse-ld=mold MORPHBUS_HAS_MOLD)
    check_linker_flag(CXX -fuse-ld=gold MORPHBUS_HAS_GOLD)
    if(MORPHBUS_HAS_MOLD)
      target_link_options(morphbus_sanitize INTERFACE -fuse-ld=mold)
    elseif(MORPHBUS_HAS_GOLD)
      target_link_options(morphbus_sanitize INTERFACE -fuse-ld=gold)
    endif()
    # Each of UBSan's checks is described by data with pointers: half a million relocations in morphbus, a sixth of the time
    # of each of the thousands of starts in the suite. A program at a fixed address has none.
    target_link_options(morphbus_sanitize INTERFACE -no-pie)
    # AddressSanitizer stops where a null pointer is followed, and where a pointer that has left its object is; checked
    # again by UBSan (null, pointer-overflow, object-size) these are most of the time that the build takes, and the last is
    # half of what code with Eigen takes to run, in which nothing is inlined. Checks of alignment, at every access, are a
    # third of what is left. The fuzz targets, which read all that comes from outside, have all four.
    target_compile_options(morphbus_sanitize INTERFACE
      "$<$<NOT:$<BOOL:$<TARGET_PROPERTY:MORPHBUS_NOT_SANITIZED>>>:-fno-sanitize=null,pointer-overflow,object-size,alignment>")
  endif()
  # GCC's flow analysis reports false null dereferences and uninitialised reads in instrumented code.
  target_compile_options(morphbus_warnings INTERFACE
    $<$<CXX_COMPILER_ID:GNU>:-Wno-null-dereference> $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
endif()

# At -O2, GCC 12's flow analysis calls moves of vectors in its own headers null dereferences and dangling pointers;
# the dev preset, whose warnings are errors, looks for the real ones.
target_compile_options(morphbus_warnings INTERFACE
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<CONFIG:Release>>:-Wno-null-dereference>
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<CONFIG:Release>>:-Wno-dangling-pointer>)

if(MORPHBUS_FUZZ)
  # Without coverage of the code under test libFuzzer would search blindly.
  target_compile_options(morphbus_sanitize INTERFACE -fsanitize=fuzzer-no-link)
endif()

# Several sources compiled as one: headers are read and templates instantiated once for all of them.
# A file must still include what it uses, and its helpers need names that no neighbour's have
# (tools/lint/helper_names): the dev and tsan presets compile every source alone.
set(MORPHBUS_UNITY 0 CACHE STRING "How many sources to compile as one; 0: each alone")
function(morphbus_unity target)
  if(MORPHBUS_UNITY GREATER 1)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${MORPHBUS_UNITY})
  endif()
endfunction()

# Under the sanitizers code whose speed nobody would notice is compiled without optimization, which takes
# half the time: the tests' own, the commands. What they call keeps its own.
set(MORPHBUS_TEST_OPTIONS "" CACHE STRING "Further options of the tests' own sources and the commands', e.g. -O0")

# morphbus_compile_alone(FILE...): sources whose helpers have the names of a neighbour's.
function(morphbus_compile_alone)
  set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# morphbus_optimize_compiling(TARGET): for code that runs once a command or serves people, whose speed nobody
# would notice. With -Os it compiles in four fifths of the time.
function(morphbus_optimize_compiling target)
  if(TARGET ${target})
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-Os> ${MORPHBUS_TEST_OPTIONS})
  endif()
endfunction()

# morphbus_compile_as_test(TARGET SOURCES a.cc ...): for programs and libraries of the tests' own sources.
function(morphbus_compile_as_test target)
  target_compile_options(${target} PRIVATE ${MORPHBUS_TEST_OPTIONS})
  morphbus_without_instructions(${target} ${ARGN})
  morphbus_use_precompiled(${target} morphbus_pch_test)
  if(TARGET morphbus_pch_test)
    # What the set's headers are read with, whether or not the target itself uses them.
    target_include_directories(${target} SYSTEM PRIVATE $<TARGET_PROPERTY:Eigen3::Eigen,INTERFACE_INCLUDE_DIRECTORIES>)
    target_compile_options(${target} PRIVATE $<TARGET_PROPERTY:GTest::gtest,INTERFACE_COMPILE_OPTIONS>)
  endif()
endfunction()

# morphbus_library(NAME SOURCES a.cc ... DEPS lib ...): a static library of this project.
function(morphbus_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS;PRIVATE_DEPS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  morphbus_unity(${name})
  target_include_directories(${name} PUBLIC ${CMAKE_SOURCE_DIR})
  target_include_directories(${name} SYSTEM PUBLIC ${EXPECTED_INCLUDE_DIR})
  target_link_libraries(${name} PUBLIC ${ARG_DEPS} morphbus_sanitize
                                PRIVATE ${ARG_PRIVATE_DEPS} morphbus_warnings)
  if(CMAKE_CURRENT_SOURCE_DIR MATCHES "^${CMAKE_SOURCE_DIR}/test")
    morphbus_compile_as_test(${name} SOURCES ${ARG_SOURCES})
  endif()
endfunction()

# morphbus_executable(NAME SOURCES a.cc ... DEPS lib ...): a program, in <build>/bin.
function(morphbus_executable name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR})
  target_include_directories(${name} SYSTEM PRIVATE ${EXPECTED_INCLUDE_DIR})
  target_link_libraries(${name} PRIVATE ${ARG_DEPS} morphbus_warnings morphbus_sanitize)
endfunction()

# A program under the sanitizers takes a tenth of a second to start and to end, and there are thousands of test cases.
option(MORPHBUS_TESTS_BY_CASE "Each test case is started alone, as an entry of ctest; else each test program is" ON)

# What is labelled slow is not run under sanitizers, and need not be built there.
option(MORPHBUS_SLOW_SANITIZED "Build the tests that are labelled slow under sanitizers, too" OFF)

# morphbus_test(NAME SOURCES a.cc ... DEPS lib ... [LABELS fast|net|slow] [PRIVATE_NETWORK] [SHARDS n]): one
# GoogleTest program; a ctest entry a test case, or one for each of its SHARDS (MORPHBUS_TESTS_BY_CASE). If it speaks over LCM
# each case has a network of its own. Those labelled slow compute much (all of a space, an accuracy, another engine's results) and
# read little: tools/check has them in the release build, and only with --all under sanitizers, too.
function(morphbus_test name)
  cmake_parse_arguments(ARG "SERIAL;PRIVATE_NETWORK" "TIMEOUT;SHARDS" "SOURCES;DEPS;LABELS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  morphbus_unity(${name})
  target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR})
  target_include_directories(${name} SYSTEM PRIVATE ${EXPECTED_INCLUDE_DIR})
  target_link_libraries(${name} PRIVATE ${ARG_DEPS} morphbus_test_source_dir GTest::gtest GTest::gtest_main
                                        morphbus_warnings morphbus_sanitize)
  morphbus_compile_as_test(${name} SOURCES ${ARG_SOURCES})
  if("slow" IN_LIST ARG_LABELS)
    add_dependencies(end_to_end ${name})
    if(MORPHBUS_SANITIZE AND NOT MORPHBUS_SLOW_SANITIZED AND NOT ARG_PRIVATE_NETWORK)
      set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL TRUE)
    endif()
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 600)
  endif()
  set(props TIMEOUT ${ARG_TIMEOUT})
  if(ARG_LABELS)
    list(APPEND props LABELS "${ARG_LABELS}")
  endif()
  if(ARG_SERIAL)
    list(APPEND props RUN_SERIAL TRUE)
  endif()
  if(ARG_PRIVATE_NETWORK)
    # CMake starts an emulated target's tests through its emulator, which it must know by now.
    set_target_properties(${name} PROPERTIES
      CROSSCOMPILING_EMULATOR ${CMAKE_SOURCE_DIR}/test/support/netns.sh)
  endif()
  if(MORPHBUS_TESTS_BY_CASE OR ARG_PRIVATE_NETWORK)
    gtest_discover_tests(${name} TEST_PREFIX "${name}." PROPERTIES ${props} DISCOVERY_TIMEOUT 600)
    return()
  endif()
  if(NOT ARG_SHARDS)
    set(ARG_SHARDS 1)
  endif()
  math(EXPR last "${ARG_SHARDS} - 1")
  foreach(shard RANGE ${last})
    math(EXPR number "${shard} + 1")
    set(entry ${name}.${number}_of_${ARG_SHARDS})
    add_test(NAME ${entry} COMMAND ${name})
    # Of what hangs the output names the case.
    set_tests_properties(${entry} PROPERTIES ${props} TIMEOUT 1800
      ENVIRONMENT "GTEST_TOTAL_SHARDS=${ARG_SHARDS};GTEST_SHARD_INDEX=${shard}")
  endforeach()
endfunction()
include(GoogleTest)

# morphbus_fuzz_target(NAME SOURCES a.cc ... DEPS lib ... CORPUS dir ... [MUTATOR b.cc ...]): the same
# entry point twice: NAME_replay runs the corpus in the plain suite; NAME (libFuzzer) exists with
# MORPHBUS_FUZZ, with the custom mutator if there is one.
function(morphbus_fuzz_target name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPS;CORPUS;MUTATOR" ${ARGN})
  add_executable(${name}_replay ${ARG_SOURCES})
  target_include_directories(${name}_replay PRIVATE ${CMAKE_SOURCE_DIR})
  target_include_directories(${name}_replay SYSTEM PRIVATE ${EXPECTED_INCLUDE_DIR})
  target_link_libraries(${name}_replay PRIVATE morphbus_replay_main ${ARG_DEPS} morphbus_warnings morphbus_sanitize)
  morphbus_compile_as_test(${name}_replay SOURCES ${ARG_SOURCES})
  add_test(NAME ${name}_replay COMMAND ${name}_replay ${ARG_CORPUS})
  set_tests_properties(${name}_replay PROPERTIES TIMEOUT 600 LABELS fuzz)
  if(MORPHBUS_FUZZ)
    add_executable(${name} ${ARG_SOURCES} ${ARG_MUTATOR})
    target_include_directories(${name} PRIVATE ${CMAKE_SOURCE_DIR})
    target_include_directories(${name} SYSTEM PRIVATE ${EXPECTED_INCLUDE_DIR})
    target_link_libraries(${name} PRIVATE ${ARG_DEPS} morphbus_warnings)
    target_compile_options(${name} PRIVATE -fsanitize=fuzzer,address,undefined)
    target_link_options(${name} PRIVATE -fsanitize=fuzzer,address,undefined)
    if(NOT TARGET fuzz_targets)
      add_custom_target(fuzz_targets)
    endif()
    add_dependencies(fuzz_targets ${name})
  endif()
endfunction()
