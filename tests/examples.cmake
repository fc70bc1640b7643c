cmake_minimum_required(VERSION 3.25)
# Installs the build in BUILD into a folder of its own, then configures, builds and runs EXAMPLES against that package alone.
# Then asks the package for a component that it does not have.
set(place ${BUILD}/examples)
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(status)
    string(JOIN " " command ${ARGN})
    message(FATAL_ERROR "${command}\nended with ${status}:\n${output}")
  endif()
endfunction()
file(REMOVE_RECURSE ${place})  # what an earlier version installed must not be found
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${place}/install)
foreach(file share/man/man1/livetet.1.gz share/man/man1/livetet-solve.1.gz share/bash-completion/completions/livetet
    share/zsh/site-functions/_livetet share/livetet/scene.schema.json share/livetet/study.schema.json)
  if(NOT EXISTS ${place}/install/${file})
    message(FATAL_ERROR "the install tree has no ${file}")
  endif()
endforeach()
run(${CMAKE_COMMAND} -S ${EXAMPLES} -B ${place}/build -G ${GENERATOR} -DCMAKE_BUILD_TYPE=Release
  -DCMAKE_PREFIX_PATH=${place}/install -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER})
run(${CMAKE_COMMAND} --build ${place}/build)
run(${CMAKE_CTEST_COMMAND} --test-dir ${place}/build --output-on-failure --no-tests=error)

file(WRITE ${place}/nonsense/CMakeLists.txt [=[
cmake_minimum_required(VERSION 3.25)
project(nonsense LANGUAGES C CXX)
find_package(livetet 0.2 REQUIRED COMPONENTS core OPTIONAL_COMPONENTS nonsense)  # optional: found without it
find_package(livetet 0.2 REQUIRED COMPONENTS core nonsense)
]=])
execute_process(COMMAND ${CMAKE_COMMAND} -S ${place}/nonsense -B ${place}/nonsense/build -G ${GENERATOR}
  -DCMAKE_PREFIX_PATH=${place}/install RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
string(REGEX REPLACE "[ \n]+" " " output "${output}")
if(NOT status OR NOT output MATCHES "no component \"nonsense\", expected core, solvers, ")
  message(FATAL_ERROR "find_package with a component that there is not ended with ${status}:\n${output}")
endif()
