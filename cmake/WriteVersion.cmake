# Writes version_text.h, only if what stands there has changed: run at every build, since a commit changes no file that a
# build looks at. Called with -DVERSION=, -DSOURCE= (the repository) and -DOUTPUT= (the file).
set(text ${VERSION})
# In an archive that `git archive` has made (.gitattributes) the commit stands in this file, and the folder may lie in a
# repository of something else.
file(STRINGS ${CMAKE_CURRENT_LIST_DIR}/archived_commit.txt archived REGEX "^[0-9a-f]+$")
if(archived)
  string(SUBSTRING ${archived} 0 8 commit)
  string(APPEND text "-${commit}")
else()
  execute_process(COMMAND git -C ${SOURCE} rev-parse --short=8 HEAD
                  OUTPUT_VARIABLE commit ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE RESULT_VARIABLE failed)
  if(NOT failed)
    string(APPEND text "-${commit}")
    execute_process(COMMAND git -C ${SOURCE} diff --quiet HEAD -- RESULT_VARIABLE changed ERROR_QUIET)
    if(changed)
      string(APPEND text "+")
    endif()
  endif()
endif()
set(line "#define MORPHBUS_VERSION_TEXT \"${text}\"\n")
set(there "")
if(EXISTS ${OUTPUT})
  file(READ ${OUTPUT} there)
endif()
if(NOT there STREQUAL line)
  file(WRITE ${OUTPUT} "${line}")
endif()
