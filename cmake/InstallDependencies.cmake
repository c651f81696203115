# Installs the shared libraries that programs need into `folder` below the prefix, with the licences of these and of what was compiled in, as
# their Debian packages have them. Run while installing, with `programs` and `libraries`: the files whose dependencies these are.
set(destination "${CMAKE_INSTALL_PREFIX}/${folder}")
file(GET_RUNTIME_DEPENDENCIES EXECUTABLES ${programs} LIBRARIES ${libraries} RESOLVED_DEPENDENCIES_VAR found
  # The C library and the C++ library belong to the system: another one's would not go with its loader, or with programs that
  # were compiled there.
  PRE_EXCLUDE_REGEXES "^ld-linux" "^lib(c|m|dl|rt|pthread|resolv|gcc_s|stdc\\+\\+)\\.so" "^libmorphbus-")
# Headers, and archives that are linked in.
set(packages libboost-dev libcli11-dev libeigen3-dev libexpected-dev libpagmo-dev libsodium-dev libspdlog-dev libtomlplusplus-dev
    nlohmann-json3-dev pybind11-dev)
foreach(library IN LISTS found)
  file(INSTALL DESTINATION "${destination}" TYPE SHARED_LIBRARY FOLLOW_SYMLINK_CHAIN FILES "${library}")
  get_filename_component(real "${library}" REALPATH)
  get_filename_component(name "${real}" NAME)
  execute_process(COMMAND dpkg-query --search "*/${name}" OUTPUT_VARIABLE owner ERROR_QUIET)
  if(NOT owner MATCHES "^([^:,\n]+)")
    message(FATAL_ERROR "${name} is of no Debian package, so that its licence is not known")
  endif()
  list(APPEND packages ${CMAKE_MATCH_1})
endforeach()

# A package's file names the licences that are on every Debian system, which others have not.
list(REMOVE_DUPLICATES packages)
set(common)
foreach(package IN LISTS packages)
  set(copyright /usr/share/doc/${package}/copyright)
  if(NOT EXISTS ${copyright})
    continue()
  endif()
  file(INSTALL DESTINATION "${destination}/licenses" TYPE FILE RENAME ${package} FILES ${copyright})
  file(STRINGS ${copyright} lines REGEX "/usr/share/common-licenses/")
  string(REGEX MATCHALL "/usr/share/common-licenses/[A-Za-z0-9.+-]*[A-Za-z0-9]" named "${lines}")
  list(APPEND common ${named})
endforeach()
list(REMOVE_DUPLICATES common)
file(INSTALL DESTINATION "${destination}/licenses/common" TYPE FILE FOLLOW_SYMLINK_CHAIN FILES ${common})
