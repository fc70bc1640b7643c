cmake_minimum_required(VERSION 3.25)
# Makes the Debian packages of the build in BUILD and checks what they hold, what they depend on, and that the program of the
# unpacked package solves. NATIVE: the build is for this machine, whose packages are refused unless asked for.
#     LIBDIR   where libraries are installed below the prefix
#     VERSION  of the project
#     PYTHON   whether the build has the Python module
#     DISPATCH whether the numerical libraries are shared
#     LINT     whether lintian judges the packages, if it is installed: half a minute more
set(place ${BUILD}/packages-test)
include(${CMAKE_CURRENT_LIST_DIR}/support/run.cmake)
function(require_match what text)
  foreach(pattern IN LISTS ARGN)
    if(NOT text MATCHES "${pattern}")
      message(FATAL_ERROR "${what}: found\n${text}\nexpected ${pattern}")
    endif()
  endforeach()
endfunction()

file(REMOVE_RECURSE ${place})
set(cpack ${CMAKE_CPACK_COMMAND} --config ${BUILD}/CPackConfig.cmake -B ${place} -D CPACK_DEBIAN_COMPRESSION_TYPE=gzip)
set(revision 1)
if(NATIVE)
  execute_process(COMMAND ${cpack} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  file(GLOB made ${place}/*.deb)
  if(NOT status OR NOT output MATCHES "LIVETET_NATIVE is ON" OR made)
    message(FATAL_ERROR "cpack of a build for this machine ended with ${status}, expected a refusal:\n${output}${made}")
  endif()
  list(APPEND cpack -D CPACK_LIVETET_ANYWAY=ON)
  set(revision 1+local)
endif()
run(output ${cpack})

# Names, versions, architectures.
file(GLOB packages RELATIVE ${place} ${place}/*.deb)
run(architecture dpkg --print-architecture)
string(STRIP "${architecture}" architecture)
set(program livetet_${VERSION}-${revision}_${architecture}.deb)
set(development livetet-dev_${VERSION}-${revision}_${architecture}.deb)
set(documentation livetet-doc_${VERSION}-${revision}_all.deb)
set(python python3-livetet_${VERSION}-${revision}_${architecture}.deb)
set(library liblivetet${VERSION}_${VERSION}-${revision}_${architecture}.deb)
set(of_machine program development)  # whose files a plain `cmake --install` installs
if(DISPATCH)
  list(APPEND of_machine library)
endif()
if(PYTHON)
  list(APPEND of_machine python)
endif()
foreach(package IN LISTS of_machine ITEMS documentation)
  if(NOT ${package} IN_LIST packages)
    message(FATAL_ERROR "cpack made ${packages}, expected ${${package}} among them")
  endif()
  run(control dpkg-deb --field ${place}/${${package}})
  require_match(${${package}} "${control}" "Maintainer: .+ <.+@.+>" "Priority: optional" "Description: real-time")
  run(unpacked dpkg-deb --extract ${place}/${${package}} ${place}/${package})
  string(REGEX REPLACE "_.*" "" name ${${package}})
  foreach(file copyright changelog.gz changelog.Debian.gz)
    if(NOT EXISTS ${place}/${package}/usr/share/doc/${name}/${file})
      message(FATAL_ERROR "${${package}} has no usr/share/doc/${name}/${file}")
    endif()
  endforeach()
  run(changelog gzip -dc ${place}/${package}/usr/share/doc/${name}/changelog.Debian.gz)
  require_match("changelog of ${name}" "${changelog}" "^${name} \\(${VERSION}-1\\) ")
endforeach()

# What the program is linked with, or loads, and what it starts.
run(depends dpkg-deb --field ${place}/${program} Depends)
require_match("Depends of ${program}" "${depends}" "libc6 \\(>= " "libgmsh[0-9.]+" "libhdf5-openmpi-" "libopenmpi3"
  "libpetsc-real3" "libvtk9" "openmpi-bin")
run(depends dpkg-deb --field ${place}/${development} Depends)
require_match("Depends of ${development}" "${depends}" "libeigen3-dev \\(>= [0-9.]+\\), libeigen3-dev \\(<< [0-9.]+~\\)"
  "libpetsc-real-dev \\(>= " "libvtk9-dev \\(>= " "libfmt-dev \\(>= ")
if(depends MATCHES "libgtest|libbenchmark|libopenigtlink|libcli11")
  message(FATAL_ERROR "${development} depends on what only the tests or the program need: ${depends}")
endif()
if(DISPATCH)
  foreach(package program development python)
    if(${package} IN_LIST of_machine)
      run(depends dpkg-deb --field ${place}/${${package}} Depends)
      require_match("Depends of ${${package}}" "${depends}" "liblivetet${VERSION} \\(>= ${VERSION}\\)")
    endif()
  endforeach()
  set(ENV{LD_LIBRARY_PATH} ${place}/library/usr/${LIBDIR})  # where apt would put it
endif()
set(executable ${place}/program/usr/bin/livetet)
foreach(file bin/livetet libexec/livetet/livetet-full libexec/livetet/livetet-lean)
  run(dynamic readelf --dynamic --wide ${place}/program/usr/${file})
  if(dynamic MATCHES "RPATH|RUNPATH")
    message(FATAL_ERROR "${program}: ${file} has a path of this build:\n${dynamic}")
  endif()
endforeach()

# Each installed file is in one package, and the packages hold nothing else.
foreach(package IN LISTS of_machine)
  run(list dpkg-deb --contents ${place}/${${package}})
  if(list MATCHES "/_CPack|${BUILD}|packages-test")
    message(FATAL_ERROR "${${package}} holds paths of this build:\n${list}")
  endif()
endforeach()
run(output ${CMAKE_COMMAND} --install ${BUILD} --prefix ${place}/whole)
file(GLOB_RECURSE whole RELATIVE ${place}/whole ${place}/whole/*)
foreach(file IN LISTS whole)
  set(count 0)
  foreach(package IN LISTS of_machine)
    if(EXISTS ${place}/${package}/usr/${file})
      math(EXPR count "${count} + 1")
    endif()
  endforeach()
  if(NOT count EQUAL 1)
    message(FATAL_ERROR "${file} is in ${count} packages, expected 1: give its install rule a COMPONENT")
  endif()
endforeach()
list(TRANSFORM of_machine REPLACE "(.+)" "${place}/\\1/usr/*" OUTPUT_VARIABLE patterns)
file(GLOB_RECURSE packaged RELATIVE ${place} ${patterns})
foreach(file IN LISTS packaged)
  string(REGEX REPLACE "^[a-z]+/usr/" "" installed ${file})
  if(NOT installed MATCHES "^share/doc/" AND NOT installed IN_LIST whole)
    message(FATAL_ERROR "${file} is packaged, but not installed")
  endif()
endforeach()
set(core liblivetet_core.a)
if(DISPATCH)
  set(core liblivetet_core.so)
endif()
foreach(file program/usr/libexec/livetet/livetet-full program/usr/libexec/livetet/livetet-lean
    program/usr/share/livetet/slicer/LivetetTrack/LivetetTrack.py program/usr/share/man/man1/livetet-solve.1.gz
    program/usr/share/livetet/scene.schema.json
    development/usr/include/livetet/mesh/tet_mesh.hpp development/usr/${LIBDIR}/${core}
    development/usr/${LIBDIR}/cmake/livetet/livetetConfig.cmake documentation/usr/share/doc/livetet-doc/docs/tutorial.md
    documentation/usr/share/doc/livetet-doc/examples/static_beam.cpp)
  if(NOT EXISTS ${place}/${file})
    message(FATAL_ERROR "the packages have no ${file}")
  endif()
endforeach()

# The unpacked program alone: a bar of 200 x 100 x 100 mm, of 5 kPa and no lateral strain, drawn by 2 mm. Its end is pulled by
# E A eps = 5000 Pa * 0.01 m^2 * 0.01 = 0.5 N. The mesh is read by the Gmsh that the package depends on.
run(output ${executable} --version)
require_match("livetet --version" "${output}" "${VERSION}")
file(COPY ${CMAKE_CURRENT_LIST_DIR}/../benchmarks/scenes/beam.msh DESTINATION ${place}/solve)
file(WRITE ${place}/solve/bar.yaml [=[
mesh: {file: beam.msh}
materials: [{young_Pa: 5000, poisson: 0, model: linear}]
fix: [{half_space_mm: [0.001, 0, 0, 1, 0, 0]}]
drive: [{half_space_mm: [199.999, 0, 0, -1, 0, 0], displacement_mm: [2, 0, 0]}]
output: {file: bar.h5}
]=])
run(output ${CMAKE_COMMAND} -E env OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OPENBLAS_NUM_THREADS=1
  ${executable} solve ${place}/solve/bar.yaml)
if(NOT output MATCHES "drive\\[0\\] +\\(([-+.0-9e]+), " OR NOT EXISTS ${place}/solve/bar.h5)
  message(FATAL_ERROR "livetet solve wrote\n${output}\nexpected the force of drive[0], and bar.h5")
endif()
set(force_N ${CMAKE_MATCH_1})
if(force_N LESS 0.499999 OR force_N GREATER 0.500001)
  message(FATAL_ERROR "a drawn bar pulls by ${force_N} N, expected 0.5 N")
endif()

# And by the program with the libraries for images.
run(output ${CMAKE_COMMAND} -E env OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OPENBLAS_NUM_THREADS=1
  ${executable} report ${place}/solve/bar.h5 --no-pictures)
require_match("livetet report" "${output}" "bar\\.report")

# Debian's own check of packages, where it is installed. That the maintainer's address is a local one, and that the changelog
# names no report of Debian's, are no errors here.
find_program(lintian lintian)
if(LINT AND lintian)
  list(TRANSFORM packages PREPEND ${place}/)
  run(output ${lintian} --allow-root --fail-on error --suppress-tags
    bogus-mail-host,bogus-mail-host-in-debian-changelog,initial-upload-closes-no-bugs ${packages})
endif()
