cmake_minimum_required(VERSION 3.25)
# Copies the public headers of the folders `folders` of `source` to `headers`/livetet. Inside
# the tree an include begins at the root ("mesh/tet_mesh.hpp", "apps/scene/scene.hpp"); the copies begin it with livetet/, so
# that nothing collides with a user's own folders.
file(REMOVE_RECURSE "${headers}")
foreach(folder IN LISTS folders)
  file(GLOB_RECURSE files RELATIVE "${source}" "${source}/${folder}/*.hpp")
  foreach(file IN LISTS files)
    file(READ "${source}/${file}" text)
    string(REGEX REPLACE "(#include \")(apps/)?([^\"]+\")" "\\1livetet/\\3" text "${text}")
    string(REGEX REPLACE "^(src|apps)/" "" file "${file}")
    file(WRITE "${headers}/livetet/${file}" "${text}")
  endforeach()
endforeach()

# An installed header may include only installed ones.
file(GLOB_RECURSE files "${headers}/*.hpp")
foreach(file IN LISTS files)
  file(STRINGS "${file}" includes REGEX "^#include \"")
  foreach(include IN LISTS includes)
    string(REGEX REPLACE "#include \"(.*)\".*" "\\1" include "${include}")
    if(NOT EXISTS "${headers}/${include}")
      message(FATAL_ERROR "${file}: includes ${include}, which is not installed")
    endif()
  endforeach()
endforeach()
