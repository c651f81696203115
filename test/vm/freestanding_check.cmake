cmake_minimum_required(VERSION 3.25)
# Proves that the VM core needs nothing but a few C functions: compiles each source freestanding and
# looks at what it leaves undefined. Arguments: COMPILER, NM, SOURCE_DIR, WORK_DIR, SOURCES (paths
# relative to vm/, separated by commas).
set(allowed
  memcpy memset memmove memcmp               # any compiler may call these four
  sinf cosf sincosf acosf sqrtf fmodf fminf fabs fmin fmax remainder sqrt      # libm
  __popcountdi2                               # libgcc
  __cxa_pure_virtual __cxa_atexit __dso_handle __stack_chk_fail _GLOBAL_OFFSET_TABLE_)
string(REPLACE "," ";" SOURCES "${SOURCES}")
foreach(source IN LISTS SOURCES)
  set(object ${WORK_DIR}/${source}.o)
  get_filename_component(folder ${object} DIRECTORY)
  file(MAKE_DIRECTORY ${folder})
  execute_process(
    COMMAND ${COMPILER} -std=c++20 -O2 -ffreestanding -fno-exceptions -fno-rtti
            -fno-threadsafe-statics -I${SOURCE_DIR} -c ${SOURCE_DIR}/vm/${source} -o ${object}
    RESULT_VARIABLE failed ERROR_VARIABLE message)
  if(failed)
    message(FATAL_ERROR "${source} does not compile freestanding:\n${message}")
  endif()
  execute_process(COMMAND ${NM} -u --format=just-symbols ${object}
                  OUTPUT_VARIABLE symbols RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "nm failed on ${object}")
  endif()
  string(REGEX REPLACE "[ \n\t]+" ";" symbols "${symbols}")
  foreach(symbol IN LISTS symbols)
    # The core's own functions, tables and vtables.
    if(symbol STREQUAL "" OR symbol MATCHES "^_Z(TV)?N?K?[0-9A-Z]*N?K?8morphbus2vm" OR
       symbol IN_LIST allowed)
      continue()
    endif()
    message(SEND_ERROR "${source} needs ${symbol}")
  endforeach()
endforeach()
