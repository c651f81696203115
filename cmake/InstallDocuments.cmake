# Installs docs/ into `folder` below the prefix, and lcmtypes/README.md with it, as wire-types.md: its links and those to it are changed
# accordingly. Run while installing, with `source`: the project's folder.
cmake_path(ABSOLUTE_PATH folder BASE_DIRECTORY "${CMAKE_INSTALL_PREFIX}" OUTPUT_VARIABLE destination)
file(INSTALL DESTINATION "${destination}" TYPE DIRECTORY FILES "${source}/docs/"
  FILES_MATCHING PATTERN "*.md" PATTERN "*.png" PATTERN "*.svg")
set(work $ENV{DESTDIR}${destination})
file(COPY_FILE "${source}/lcmtypes/README.md" "${work}/wire-types.md")
file(GLOB documents "${work}/*.md")
foreach(document IN LISTS documents)
  file(READ "${document}" text)
  string(REPLACE "](../lcmtypes/README.md" "](wire-types.md" changed "${text}")
  string(REPLACE "](../docs/" "](" changed "${changed}")
  if(NOT changed STREQUAL text)
    file(WRITE "${document}" "${changed}")
  endif()
endforeach()
