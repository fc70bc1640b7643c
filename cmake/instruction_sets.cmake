# Numerical libraries for one instruction set or, with LIVETET_DISPATCH, for several of which the system's loader takes the best
# that the processor has. See docs/how-to/packaging.md.

# Levels beside the plain x86-64, as the loader and the compiler name them: x86-64-v3 has AVX2 and fused multiply-add, x86-64-v4
# AVX-512.
set(livetet_instruction_sets x86-64-v3 x86-64-v4)
set(livetet_dispatched_folder ${PROJECT_BINARY_DIR}/lib)

# Adds the library `name` of `sources`: static or, with LIVETET_DISPATCH, shared, with a library <name>_<level> of the same name
# in the folder of the loader (glibc-hwcaps) for each further instruction set. Sets <name>_targets.
function(livetet_numerical_library name)
  if(NOT LIVETET_DISPATCH)
    add_library(${name} STATIC ${ARGN})
    set(${name}_targets ${name} PARENT_SCOPE)
    return()
  endif()
  add_library(${name} SHARED ${ARGN})
  set(targets ${name})
  set(folder ${livetet_dispatched_folder})
  set_target_properties(${name} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${folder})
  foreach(level IN LISTS livetet_instruction_sets)
    set(variant ${name}_${level})
    add_library(${variant} SHARED ${ARGN})
    set_target_properties(${variant} PROPERTIES OUTPUT_NAME ${name} LIBRARY_OUTPUT_DIRECTORY ${folder}/glibc-hwcaps/${level})
    target_compile_options(${variant} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-march=${level}>)
    add_dependencies(${name} ${variant})
    install(FILES $<TARGET_FILE:${variant}> DESTINATION ${CMAKE_INSTALL_LIBDIR}/glibc-hwcaps/${level} COMPONENT library
      PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
    list(APPEND targets ${variant})
  endforeach()
  foreach(target IN LISTS targets)
    # Nothing is binary compatible between versions. Functions of the library are called as they were compiled for it, even where
    # the program has the same inline function for a lesser processor. The loader searches ${ORIGIN} for the other libraries.
    set_target_properties(${target} PROPERTIES VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION} BUILD_RPATH "\$ORIGIN"
      INSTALL_RPATH "$<$<NOT:$<BOOL:${livetet_installs_where_searched}>>:\$ORIGIN>")
    target_link_options(${target} PRIVATE LINKER:-Bsymbolic-functions)
  endforeach()
  set(${name}_targets ${targets} PARENT_SCOPE)
endfunction()

# Has what is installed in `folder` find the shared libraries from there.
function(livetet_finds_libraries target folder)
  if(NOT LIVETET_DISPATCH OR livetet_installs_where_searched)
    return()
  endif()
  cmake_path(RELATIVE_PATH CMAKE_INSTALL_FULL_LIBDIR BASE_DIRECTORY ${CMAKE_INSTALL_PREFIX}/${folder} OUTPUT_VARIABLE path)
  set_target_properties(${target} PROPERTIES INSTALL_RPATH "\$ORIGIN/${path}")
endfunction()

# Whether the loader searches the folder that libraries are installed in.
set(livetet_installs_where_searched OFF)
if(CMAKE_INSTALL_FULL_LIBDIR IN_LIST CMAKE_CXX_IMPLICIT_LINK_DIRECTORIES)
  set(livetet_installs_where_searched ON)
endif()
if(LIVETET_DISPATCH AND NOT CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$")
  message(FATAL_ERROR "LIVETET_DISPATCH: found a processor ${CMAKE_SYSTEM_PROCESSOR}, expected x86_64")
endif()
if(LIVETET_DISPATCH AND (LIVETET_NATIVE OR LIVETET_SANITIZE))
  message(FATAL_ERROR "LIVETET_DISPATCH: found LIVETET_NATIVE or LIVETET_SANITIZE ON, expected both OFF")
endif()
