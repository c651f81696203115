# What `cmake --install` puts where: the programs, what they read, and what shells and man know of them.

install(TARGETS morphbus morphbus-module)
# The programs look for it beside their own folder (tools/base/share_folder.h), so that the installed tree can be moved.
install(DIRECTORY ${CMAKE_BINARY_DIR}/share/morphbus DESTINATION share OPTIONAL)
install(DIRECTORY models DESTINATION share/morphbus)
# For other LCM programs, which make their own code of them.
install(DIRECTORY lcmtypes DESTINATION share/morphbus FILES_MATCHING PATTERN "*.lcm" PATTERN "README.md")
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(CODE "set(folder \"${CMAKE_INSTALL_DOCDIR}\")\nset(source \"${CMAKE_SOURCE_DIR}\")")
install(SCRIPT cmake/InstallDocuments.cmake)

set(shell tools/shell/morphbus)
install(FILES ${shell}.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME morphbus)
install(FILES ${shell}.zsh DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions RENAME _morphbus)
install(FILES ${shell}.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)

# Written by the program where it could be run (tools/CMakeLists.txt).
install(DIRECTORY ${CMAKE_BINARY_DIR}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 OPTIONAL)

# The libraries for other people's programs, with what finds them: find_package(Morphbus), pkg-config.
if(MORPHBUS_LIBRARIES)
  install(DIRECTORY examples DESTINATION ${CMAKE_INSTALL_DOCDIR})
  include(CMakePackageConfigHelpers)
  get_property(MORPHBUS_PUBLIC_LIBRARIES GLOBAL PROPERTY MORPHBUS_PUBLIC_LIBRARIES)
  list(TRANSFORM MORPHBUS_PUBLIC_LIBRARIES PREPEND morphbus- OUTPUT_VARIABLE targets)
  install(TARGETS ${targets} EXPORT MorphbusTargets)
  # No program links it itself.
  install(TARGETS morphbus-messages EXPORT MorphbusTargets LIBRARY NAMELINK_SKIP)
  install(DIRECTORY include/morphbus ${MORPHBUS_PUBLIC_HEADERS}/morphbus DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
          FILES_MATCHING PATTERN "*.h")
  set(package ${CMAKE_INSTALL_LIBDIR}/cmake/Morphbus)
  install(EXPORT MorphbusTargets NAMESPACE Morphbus:: DESTINATION ${package})
  configure_package_config_file(cmake/MorphbusConfig.cmake.in ${CMAKE_BINARY_DIR}/MorphbusConfig.cmake INSTALL_DESTINATION ${package})
  write_basic_package_version_file(${CMAKE_BINARY_DIR}/MorphbusConfigVersion.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${CMAKE_BINARY_DIR}/MorphbusConfig.cmake ${CMAKE_BINARY_DIR}/MorphbusConfigVersion.cmake DESTINATION ${package})
  # The installed tree can be moved: pkg-config knows where its files lie.
  foreach(kind LIBDIR INCLUDEDIR)
    set(of_pkgconfig_${kind} "\${prefix}/${CMAKE_INSTALL_${kind}}")
    if(IS_ABSOLUTE "${CMAKE_INSTALL_${kind}}")
      set(of_pkgconfig_${kind} "${CMAKE_INSTALL_${kind}}")
    endif()
  endforeach()
  set(of_pkgconfig_prefix "${CMAKE_INSTALL_PREFIX}")
  if(NOT IS_ABSOLUTE "${CMAKE_INSTALL_LIBDIR}")
    file(RELATIVE_PATH from_here /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
    set(of_pkgconfig_prefix "\${pcfiledir}/${from_here}")
  endif()
  foreach(name IN LISTS MORPHBUS_PUBLIC_LIBRARIES)
    get_property(used GLOBAL PROPERTY MORPHBUS_USES_${name})
    list(TRANSFORM used PREPEND morphbus-)
    list(JOIN used ", " used)
    configure_file(cmake/morphbus.pc.in ${CMAKE_BINARY_DIR}/pkgconfig/morphbus-${name}.pc @ONLY)
    install(FILES ${CMAKE_BINARY_DIR}/pkgconfig/morphbus-${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
  endforeach()
endif()

# A tarball of all this, with the libraries that it needs (docs/install.md): the target `package`.
if(MORPHBUS_SELF_CONTAINED)
  set(programs "$<TARGET_FILE:morphbus>;$<TARGET_FILE:morphbus-module>")
  set(libraries "")
  foreach(target IN LISTS targets)
    list(APPEND libraries "$<TARGET_FILE:${target}>")
  endforeach()
  install(CODE "set(folder \"${MORPHBUS_OTHERS_DIR}\")\nset(programs \"${programs}\")\nset(libraries \"${libraries}\")")
  install(SCRIPT cmake/InstallDependencies.cmake)
  set(CPACK_GENERATOR TXZ)
  set(CPACK_PACKAGE_FILE_NAME morphbus-${PROJECT_VERSION}-${CMAKE_SYSTEM_NAME}-${CMAKE_SYSTEM_PROCESSOR})
  set(CPACK_STRIP_FILES ON)
  set(CPACK_VERBATIM_VARIABLES ON)
  include(CPack)
endif()
