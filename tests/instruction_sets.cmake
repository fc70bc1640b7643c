cmake_minimum_required(VERSION 3.25)
# Installs the build in BUILD of SOURCE, which has numerical libraries for several instruction sets, and runs the program with
# those of each that this processor has. The environment hides the better ones, as on a processor that lacks them.
#     LIBDIR    where libraries are installed below the prefix
#     VERSION   of the project
set(place ${BUILD}/instruction-sets)
include(${CMAKE_CURRENT_LIST_DIR}/support/run.cmake)

file(REMOVE_RECURSE ${place})
run(output ${CMAKE_COMMAND} --install ${BUILD} --prefix ${place}/install)
foreach(file liblivetet_core.so glibc-hwcaps/x86-64-v3/liblivetet_core.so.${VERSION}
    glibc-hwcaps/x86-64-v4/liblivetet_solvers.so.${VERSION})
  if(NOT EXISTS ${place}/install/${LIBDIR}/${file})
    message(FATAL_ERROR "the install tree has no ${LIBDIR}/${file}")
  endif()
endforeach()

# Which sets this processor has, by the loader's own account.
set(sets x86-64)
set(masked_x86-64 "-AVX2,-AVX512F")
execute_process(COMMAND /lib64/ld-linux-x86-64.so.2 --help OUTPUT_VARIABLE loader ERROR_QUIET)
if(loader MATCHES "x86-64-v3 \\(supported")
  list(APPEND sets x86-64-v3)
  set(masked_x86-64-v3 "-AVX512F")
endif()
if(loader MATCHES "x86-64-v4 \\(supported")
  list(APPEND sets x86-64-v4)
  set(masked_x86-64-v4 "")
endif()

file(COPY ${SOURCE}/benchmarks/scenes/beam.msh DESTINATION ${place}/solve)
file(WRITE ${place}/solve/bar.yaml [=[
mesh: {file: beam.msh, levels: 1}
materials: [{young_Pa: 5000, poisson: 0.45, model: neohookean}]
fix: [{half_space_mm: [0.001, 0, 0, 1, 0, 0]}]
drive: [{half_space_mm: [199.999, 0, 0, -1, 0, 0], displacement_mm: [20, -30, 0]}]
solver: {newton_tolerance: 1e-10}
output: {file: bar.h5}
]=])
foreach(set IN LISTS sets)
  # The prefix is not the one that the build was configured for.
  set(livetet ${CMAKE_COMMAND} -E env LD_LIBRARY_PATH=${place}/install/${LIBDIR} GLIBC_TUNABLES=glibc.cpu.hwcaps=${masked_${set}} OMPI_ALLOW_RUN_AS_ROOT=1
    OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OPENBLAS_NUM_THREADS=1 ${place}/install/bin/livetet)
  run(output ${livetet} --version)
  if(NOT output MATCHES "numerical libraries for ${set}\n")
    message(FATAL_ERROR "livetet --version with GLIBC_TUNABLES=${masked_${set}}: found\n${output}expected ${set}")
  endif()
  run(output ${livetet} solve ${place}/solve/bar.yaml)
  if(NOT output MATCHES "drive\\[0\\] +\\(([-+.0-9e]+), ([-+.0-9e]+), ")
    message(FATAL_ERROR "livetet solve for ${set} wrote\n${output}\nexpected the force of drive[0]")
  endif()
  set(force "${CMAKE_MATCH_1} ${CMAKE_MATCH_2}")
  if(NOT DEFINED first)
    set(first "${force}")
  elseif(NOT force STREQUAL first)
    message(FATAL_ERROR "drive[0] pulls by ${force} N with ${set}, expected ${first} N as with x86-64")
  endif()
  # Kernels of solve, with and without pressures, and those of live frames with four and ten nodes.
  run(output ${livetet} bench verification --only patch)
  foreach(model corotated neohookean green)
    run(output ${livetet} bench stability --cells 2 --budget 50 --only "patch presses" --column "${model}, static")
  endforeach()
  message(STATUS "${set}: ${force} N")
endforeach()
