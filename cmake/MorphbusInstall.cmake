# What `cmake --install` puts where: the programs, what they read, and what shells and man know of them.
include(GNUInstallDirs)

install(TARGETS morphbus morphbus-module)
# The programs look for it beside their own folder (tools/base/share_folder.h), so that the installed tree can be moved.
install(DIRECTORY ${CMAKE_BINARY_DIR}/share/morphbus DESTINATION share OPTIONAL)
install(DIRECTORY models DESTINATION share/morphbus)

set(shell tools/shell/morphbus)
install(FILES ${shell}.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME morphbus)
install(FILES ${shell}.zsh DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions RENAME _morphbus)
install(FILES ${shell}.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)

# Written by the program where it could be run (tools/CMakeLists.txt).
install(DIRECTORY ${CMAKE_BINARY_DIR}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 OPTIONAL)
