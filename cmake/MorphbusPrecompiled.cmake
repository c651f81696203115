# Precompiled headers: most of a clean build is spent reading Eigen, json and GoogleTest again and
# again. They only save time: with MORPHBUS_PCH=OFF (as in the tsan preset) every file must still
# include what it uses.
option(MORPHBUS_PCH "Precompile the headers of other people's libraries" ON)

# CLI11 is in no set: its inline functions instantiate templates for seconds in every source that
# sees it, precompiled or not, so only the files that define options include it.
#
# The set's macros must be those of its users, or GCC will not take the precompiled form.
add_library(morphbus_pch_flags INTERFACE)
target_compile_definitions(morphbus_pch_flags INTERFACE FMT_SHARED)

# morphbus_precompiled(NAME DEPS lib ... HEADERS <a> ...): a set of headers.
function(morphbus_precompiled name)
  cmake_parse_arguments(ARG "" "" "DEPS;HEADERS" ${ARGN})
  if(NOT MORPHBUS_PCH)
    return()
  endif()
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/pch/${name}.cc CONTENT "// Carries ${name}.\n")
  add_library(${name} OBJECT ${CMAKE_BINARY_DIR}/pch/${name}.cc)
  target_link_libraries(${name} PRIVATE ${ARG_DEPS} morphbus_pch_flags morphbus_warnings morphbus_sanitize)
  target_precompile_headers(${name} PRIVATE ${ARG_HEADERS})
endfunction()

# morphbus_use_precompiled(TARGET NAME): reads set NAME before each of the target's sources, if both are instrumented by sanitizers or
# neither is.
function(morphbus_use_precompiled target name)
  if(NOT TARGET ${name})
    return()
  endif()
  get_target_property(target_plain ${target} MORPHBUS_NOT_SANITIZED)
  get_target_property(set_plain ${name} MORPHBUS_NOT_SANITIZED)
  if("${target_plain}" STREQUAL "${set_plain}" OR (NOT target_plain AND NOT set_plain))
    target_link_libraries(${target} PRIVATE morphbus_pch_flags)
    target_precompile_headers(${target} REUSE_FROM ${name})
  endif()
endfunction()

set(standard_headers <algorithm> <array> <cmath> <cstdint> <cstring> <filesystem> <fstream> <functional>
    <limits> <map> <memory> <numbers> <optional> <random> <set> <sstream> <string> <string_view> <utility>
    <variant> <vector> <fmt/format.h>)
set(math_headers ${standard_headers} <Eigen/Core> <Eigen/Geometry>)
morphbus_precompiled(morphbus_pch_math DEPS Eigen3::Eigen HEADERS ${math_headers})
morphbus_precompiled(morphbus_pch_json
  DEPS Eigen3::Eigen nlohmann_json::nlohmann_json HEADERS ${math_headers} <nlohmann/json.hpp>)
# A set is compiled as its users are.
morphbus_optimize_compiling(morphbus_pch_json)
if(GTest_FOUND)
  morphbus_precompiled(morphbus_pch_test
    DEPS Eigen3::Eigen GTest::gtest HEADERS ${math_headers} <gtest/gtest.h>)
endif()
if(TARGET morphbus_pch_test)
  target_compile_options(morphbus_pch_test PRIVATE ${MORPHBUS_TEST_OPTIONS})
  morphbus_without_instructions(morphbus_pch_test)
endif()
