# Debian packages by CPack, one for each component of the install rules: `cpack --preset package`. See
# docs/how-to/packaging.md. A folder with files for a package of its own installs them with `COMPONENT name`, and calls
# livetet_debian_package(name ...) before livetet_make_packages().
set(LIVETET_DEBIAN_REVISION 1)

# Sets `variable` to what a package that holds code of the installed Debian package `name` depends on: that version or a newer
# one with the same first two numbers. Static libraries hold inline functions and types of the headers that they were compiled
# with; the first two numbers are what the libraries change when these change.
function(livetet_same_minor_version name variable)
  execute_process(COMMAND ${LIVETET_DPKG_QUERY} -W -f "\${db:Status-Status} \${Version}" ${name}
    OUTPUT_VARIABLE version ERROR_QUIET)
  if(NOT version MATCHES "^installed (([0-9]+:)?([0-9]+)\\.([0-9]+)[^-]*)")
    message(FATAL_ERROR "${name}: found \"${version}\" installed, expected a version whose first two numbers are known")
  endif()
  math(EXPR next "${CMAKE_MATCH_4} + 1")
  set(${variable} "${name} (>= ${CMAKE_MATCH_1}), ${name} (<< ${CMAKE_MATCH_2}${CMAKE_MATCH_3}.${next}~)" PARENT_SCOPE)
endfunction()

# Sets `variable` to the dependencies of the development package: the libraries of apps/packages.txt but those of the tests and
# those that no installed target needs (Gmsh is loaded, CLI11 is the commands', pybind11 the Python module's).
function(livetet_development_dependencies variable)
  file(STRINGS ${PROJECT_SOURCE_DIR}/apps/packages.txt lines)
  set(depends pkg-config)
  foreach(line IN LISTS lines)
    if(line MATCHES "^# tests")
      break()
    endif()
    if(line MATCHES "^[^#].*-dev$" AND NOT line MATCHES "^(lib(gmsh|cli11)|pybind11|python3)-dev$")
      livetet_same_minor_version(${line} one)
      list(APPEND depends "${one}")
    endif()
  endforeach()
  string(JOIN ", " depends ${depends})
  set(${variable} "${depends}" PARENT_SCOPE)
endfunction()

# Sets `variable` to the Debian package with the library that a program loads by the soname `soname`.
function(livetet_package_of_library soname variable)
  execute_process(COMMAND ${LIVETET_DPKG_QUERY} -S "*/${soname}" OUTPUT_VARIABLE output ERROR_QUIET)
  if(NOT output MATCHES "^([^:, ]+)")
    message(FATAL_ERROR "${soname}: belongs to no Debian package, expected a library of one")
  endif()
  set(${variable} ${CMAKE_MATCH_1} PARENT_SCOPE)
endfunction()

# Writes the file `from` compressed to `to`, without its time.
function(livetet_compress from to)
  execute_process(COMMAND gzip -9cn ${from} OUTPUT_FILE ${to} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# Keeps the value of CPACK_DEBIAN_<name> for livetet_make_packages(), whichever folder calls.
function(livetet_package_setting name value)
  set_property(GLOBAL APPEND PROPERTY livetet_package_settings ${name})
  set_property(GLOBAL PROPERTY livetet_package_setting_${name} "${value}")
endfunction()

# Declares the Debian package `name` of the files installed with COMPONENT `component`.
#     SECTION, SUMMARY, DESCRIPTION  of its control file
#     DEPENDS, RECOMMENDS            lists; the shared libraries of its programs are added (dpkg-shlibdeps)
#     ALL                            its files are the same on all machines
function(livetet_debian_package component name)
  cmake_parse_arguments(PARSE_ARGV 2 arg "ALL" "SECTION;SUMMARY;DESCRIPTION" "DEPENDS;RECOMMENDS")
  set_property(GLOBAL APPEND PROPERTY livetet_package_components ${component})
  string(TOUPPER ${component} upper)
  string(JOIN ", " depends ${arg_DEPENDS})
  string(JOIN ", " recommends ${arg_RECOMMENDS})
  set(shlibdeps ON)
  set(architecture ${LIVETET_DEBIAN_ARCHITECTURE})
  if(arg_ALL)
    set(shlibdeps OFF)
    set(architecture all)
  endif()
  livetet_package_setting(${upper}_PACKAGE_NAME ${name})
  livetet_package_setting(${upper}_PACKAGE_SECTION ${arg_SECTION})
  livetet_package_setting(${upper}_PACKAGE_DEPENDS "${depends}")
  livetet_package_setting(${upper}_PACKAGE_RECOMMENDS "${recommends}")
  livetet_package_setting(${upper}_PACKAGE_SHLIBDEPS ${shlibdeps})
  livetet_package_setting(${upper}_PACKAGE_ARCHITECTURE ${architecture})
  livetet_package_setting(${upper}_DESCRIPTION "${arg_SUMMARY}\n${arg_DESCRIPTION}")

  # Not part of a plain `cmake --install`.
  set(made ${PROJECT_BINARY_DIR}/packaging/${name})
  set(documents ${CMAKE_INSTALL_DATADIR}/doc/${name})
  configure_file(${PROJECT_SOURCE_DIR}/apps/packaging/debian/changelog.in ${made}/changelog @ONLY)
  livetet_compress(${made}/changelog ${made}/changelog.Debian.gz)
  livetet_compress(${PROJECT_SOURCE_DIR}/CHANGELOG.md ${made}/changelog.gz)
  install(FILES ${PROJECT_SOURCE_DIR}/apps/packaging/debian/copyright ${made}/changelog.Debian.gz ${made}/changelog.gz
    DESTINATION ${documents} COMPONENT ${component} EXCLUDE_FROM_ALL)
endfunction()

# Why packages of this build would be of no use to others; empty if they would.
function(livetet_why_no_packages variable)
  set(reason "")
  if(LIVETET_NATIVE)
    set(reason "LIVETET_NATIVE is ON: the program may not run on other machines, expected OFF")
  elseif(LIVETET_SANITIZE)
    set(reason "LIVETET_SANITIZE is ON, expected OFF")
  elseif(NOT LIVETET_IMAGES)
    set(reason "LIVETET_IMAGES is OFF: most commands are missing, expected ON")
  endif()
  set(${variable} "${reason}" PARENT_SCOPE)
endfunction()

# Sets `variable` to what a package depends on whose programs are linked with the shared libraries of this project, or empty if
# they are static.
function(livetet_library_dependency variable)
  set(depends "")
  if(LIVETET_DISPATCH)
    math(EXPR next "${PROJECT_VERSION_PATCH} + 1")
    set(after ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}.${next})
    set(depends "liblivetet${PROJECT_VERSION} (>= ${PROJECT_VERSION}), liblivetet${PROJECT_VERSION} (<< ${after}~)")
  endif()
  set(${variable} "${depends}" PARENT_SCOPE)
endfunction()

# After the last livetet_debian_package() and install().
macro(livetet_make_packages)
  get_property(CPACK_COMPONENTS_ALL GLOBAL PROPERTY livetet_package_components)
  get_property(livetet_package_settings GLOBAL PROPERTY livetet_package_settings)
  foreach(setting IN LISTS livetet_package_settings)
    get_property(CPACK_DEBIAN_${setting} GLOBAL PROPERTY livetet_package_setting_${setting})
  endforeach()
  set(CPACK_GENERATOR DEB)
  set(CPACK_DEB_COMPONENT_INSTALL ON)
  set(CPACK_COMPONENTS_GROUPING IGNORE)
  set(CPACK_PACKAGE_CONTACT "${LIVETET_MAINTAINER}")
  set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
  set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
  set(CPACK_STRIP_FILES ON)
  set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
  set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
  set(CPACK_DEBIAN_PACKAGE_RELEASE ${LIVETET_DEBIAN_REVISION})
  set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
  set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${livetet_dispatched_folder})
  livetet_why_no_packages(CPACK_LIVETET_UNFIT)
  set(CPACK_PROJECT_CONFIG_FILE ${PROJECT_SOURCE_DIR}/cmake/check_package_build.cmake)
  include(CPack)
endmacro()

set(LIVETET_MAINTAINER "Livetet maintainers <livetet@localhost>" CACHE STRING "Maintainer that the Debian packages name")
string(TIMESTAMP LIVETET_PACKAGE_DATE "%a, %d %b %Y %H:%M:%S +0000" UTC)  # SOURCE_DATE_EPOCH, if it is set
execute_process(COMMAND dpkg --print-architecture OUTPUT_VARIABLE LIVETET_DEBIAN_ARCHITECTURE OUTPUT_STRIP_TRAILING_WHITESPACE
  COMMAND_ERROR_IS_FATAL ANY)
get_property(gmsh_library GLOBAL PROPERTY livetet_gmsh_library)
cmake_path(GET gmsh_library FILENAME gmsh_library)
livetet_package_of_library(${gmsh_library} gmsh_package)
livetet_development_dependencies(development)

livetet_library_dependency(library)

if(LIVETET_DISPATCH)
  livetet_debian_package(library liblivetet${PROJECT_VERSION} SECTION libs
    SUMMARY "real-time soft-tissue simulation: shared libraries"
    DESCRIPTION "Livetet makes a finite element model of an organ follow tracked sensors.
.
This package holds the numerical libraries for several instruction sets: the
loader takes those that suit the processor best."
    RECOMMENDS libopenblas0-serial)
  livetet_package_setting(LIBRARY_PACKAGE_GENERATE_SHLIBS ON)
endif()

livetet_debian_package(program livetet SECTION science
  SUMMARY "real-time soft-tissue simulation for image-guided surgery"
  DESCRIPTION "Livetet makes a finite element model of an organ follow tracked sensors. From a
segmented image it builds a hierarchy of tetrahedral meshes, registers it to an
electromagnetic tracker, and deforms the whole interior by a corotated or
hyperelastic finite element solve in every frame. The same engine runs static
and dynamic studies under mpirun.
.
This package holds the program, its manual pages, shell completions and the
JSON schemas of scenes and studies. It is no medical device."
  DEPENDS ${library} ${gmsh_package} openmpi-bin
  RECOMMENDS libopenblas0-serial xvfb xauth livetet-doc)

livetet_debian_package(development livetet-dev SECTION libdevel
  SUMMARY "real-time soft-tissue simulation: C++ library"
  DESCRIPTION "Livetet makes a finite element model of an organ follow tracked sensors.
.
This package holds the C++20 headers, what programs are linked with, and the
package that CMake's find_package(livetet) reads."
  DEPENDS ${library} ${gmsh_package} ${development}
  RECOMMENDS cmake g++ livetet-doc)

livetet_debian_package(documentation livetet-doc ALL SECTION doc
  SUMMARY "real-time soft-tissue simulation: documentation and examples"
  DESCRIPTION "Livetet makes a finite element model of an organ follow tracked sensors.
.
This package holds the tutorial, how-to pages, reference and theory in
Markdown, and examples of programs that use the library.")
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs ${PROJECT_SOURCE_DIR}/examples
  DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/livetet-doc COMPONENT documentation EXCLUDE_FROM_ALL)
install(FILES ${PROJECT_SOURCE_DIR}/README.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/livetet-doc COMPONENT documentation
  EXCLUDE_FROM_ALL)

if(TARGET livetet_python)
  math(EXPR next_minor "${Python3_VERSION_MINOR} + 1")
  livetet_debian_package(python python3-livetet SECTION python
    SUMMARY "real-time soft-tissue simulation: Python module"
    DESCRIPTION "This package holds the Python module livetet: meshes, scenes, solves, the
tracked body frame by frame, registration and results as numpy arrays."
    DEPENDS ${library} ${gmsh_package} openmpi-bin python3-numpy "python3 (>= 3.${Python3_VERSION_MINOR})" "python3 (<< 3.${next_minor})"
    RECOMMENDS libopenblas0-serial python3-mpi4py)
endif()
