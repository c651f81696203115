# The libraries for other people's programs: shared, with the symbols of their headers and no others.
option(MORPHBUS_LIBRARIES "Build and install the libraries for other people's programs" OFF)
# At the end of their names: programs that were linked with another one do not start. Before 1.0 it is that of every release, for the
# libraries know each other's insides.
set(MORPHBUS_ABI_VERSION ${PROJECT_VERSION})
if(MORPHBUS_LIBRARIES)
  # One compilation for programs and libraries; CMAKE_POSITION_INDEPENDENT_CODE would have two, and a set of precompiled headers
  # for each. Nobody puts a function of ours in the place of another one, so calls may be inlined as they are in programs.
  add_compile_options(-fPIC -fno-semantic-interposition)
endif()

# For machines without Debian's packages: what the programs and libraries need lies beside them.
option(MORPHBUS_SELF_CONTAINED "Install the libraries of other projects, too" OFF)
set(MORPHBUS_LIBRARY_RPATH "\$ORIGIN")
if(MORPHBUS_SELF_CONTAINED)
  # The older kind of path is that of the libraries' own libraries, too, which have none.
  add_link_options(LINKER:--disable-new-dtags)
  set(MORPHBUS_OTHERS_DIR ${CMAKE_INSTALL_LIBDIR}/morphbus)
  list(APPEND MORPHBUS_LIBRARY_RPATH "\$ORIGIN/morphbus")
  set(CMAKE_INSTALL_RPATH "\$ORIGIN/../${MORPHBUS_OTHERS_DIR}")
endif()

set(MORPHBUS_PUBLIC_HEADERS ${CMAKE_BINARY_DIR}/include)
configure_file(${CMAKE_SOURCE_DIR}/include/morphbus/version.h.in ${MORPHBUS_PUBLIC_HEADERS}/morphbus/version.h @ONLY)

# morphbus_public_library(NAME SOURCES a.cc ... [USES name ...] [MESSAGES] DEPS lib ... [SHOWS lib]): the library morphbus-NAME, whose headers
# are those of include/morphbus/NAME. Its sources are compiled once, as the target morphbus_public_NAME, which tests link. USES:
# other such libraries whose headers its own include. MESSAGES: it knows messages of Protocol Buffers. SHOWS: a library
# of ours whose functions of C other libraries shall find, too.
function(morphbus_public_library name)
  cmake_parse_arguments(ARG "MESSAGES" "SHOWS" "SOURCES;USES;DEPS" ${ARGN})
  set(objects morphbus_public_${name})
  add_library(${objects} OBJECT ${ARG_SOURCES})
  target_include_directories(${objects} PUBLIC ${CMAKE_SOURCE_DIR}/include ${MORPHBUS_PUBLIC_HEADERS})
  target_link_libraries(${objects} PUBLIC ${ARG_DEPS} PRIVATE morphbus_warnings morphbus_sanitize)
  target_compile_options(${objects} PRIVATE -fvisibility=hidden -fvisibility-inlines-hidden)
  if(NOT MORPHBUS_LIBRARIES)
    return()
  endif()
  set(library morphbus-${name})
  add_library(${library} SHARED $<TARGET_OBJECTS:${objects}>)
  set(shown)
  if(ARG_SHOWS)
    target_sources(${library} PRIVATE $<TARGET_OBJECTS:${ARG_SHOWS}>)
    get_property(shown GLOBAL PROPERTY MORPHBUS_ELEMENTARY_SYMBOLS)
  endif()
  set(map ${CMAKE_CURRENT_BINARY_DIR}/${library}.map)
  configure_file(${CMAKE_SOURCE_DIR}/cmake/public_symbols.map.in ${map} @ONLY)
  list(TRANSFORM ARG_USES PREPEND morphbus- OUTPUT_VARIABLE used)
  target_include_directories(${library} INTERFACE $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}/include>
    $<BUILD_INTERFACE:${MORPHBUS_PUBLIC_HEADERS}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_compile_features(${library} INTERFACE cxx_std_20)
  # Where this stands first, nothing of the archive with the same messages is linked in.
  set(messages)
  if(ARG_MESSAGES)
    set(messages -Wl,--push-state,--no-as-needed,$<TARGET_LINKER_FILE:morphbus-messages>,--pop-state)
    add_dependencies(${library} morphbus-messages)
  endif()
  target_link_libraries(${library} PUBLIC ${used} PRIVATE ${messages} ${ARG_DEPS} morphbus_sanitize)
  target_link_options(${library} PRIVATE
    # Of the archives that are linked into it nothing shows, and of its own objects what is ours.
    LINKER:--exclude-libs,ALL LINKER:--version-script=${map} LINKER:-Bsymbolic-functions
    LINKER:--gc-sections LINKER:--as-needed LINKER:-z,defs)
  # They find each other wherever the tree lies.
  set_target_properties(${library} PROPERTIES INSTALL_RPATH "${MORPHBUS_LIBRARY_RPATH}" BUILD_RPATH "\$ORIGIN" VERSION ${PROJECT_VERSION} SOVERSION ${MORPHBUS_ABI_VERSION} EXPORT_NAME ${name}
    LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/lib LINK_DEPENDS ${map})
  set_property(GLOBAL APPEND PROPERTY MORPHBUS_PUBLIC_LIBRARIES ${name})
  set_property(GLOBAL PROPERTY MORPHBUS_USES_${name} ${ARG_USES})
endfunction()
