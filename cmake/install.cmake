# Installs the libraries with their headers, the program, and the package that find_package(livetet) reads. Each file belongs
# to the component (COMPONENT) of the Debian package that holds it (cmake/packages.cmake).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# Exports `target`, livetet_<name>, as livetet::<name>, with the headers in and below this folder, or the one of its folders that
# is named. A build without images installs the headers of what it lacks as well: others include them for their types.
function(livetet_export target)
  string(REGEX REPLACE "^livetet_" "" name ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS ${target} EXPORT livetetTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT development)
  cmake_path(RELATIVE_PATH CMAKE_CURRENT_SOURCE_DIR BASE_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE folder)
  cmake_path(APPEND folder ${ARGN})
  set_property(GLOBAL APPEND PROPERTY livetet_header_folders ${folder})
  set_property(GLOBAL APPEND PROPERTY livetet_components ${name})
endfunction()

# After the last livetet_export().
function(livetet_install_package)
  get_property(folders GLOBAL PROPERTY livetet_header_folders)
  get_property(components GLOBAL PROPERTY livetet_components)
  string(JOIN ", " livetet_components ${components})  # read by livetetConfig.cmake.in
  set(package ${CMAKE_INSTALL_LIBDIR}/cmake/livetet)
  install(CODE "
    set(source \"${PROJECT_SOURCE_DIR}\")
    set(headers \"${PROJECT_BINARY_DIR}/include\")
    set(folders \"${folders}\")
    include(\"${PROJECT_SOURCE_DIR}/cmake/collect_headers.cmake\")
    file(INSTALL \"${PROJECT_BINARY_DIR}/include/livetet\"
      DESTINATION \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_INCLUDEDIR}\" TYPE DIRECTORY)" COMPONENT development)
  install(EXPORT livetetTargets NAMESPACE livetet:: DESTINATION ${package} COMPONENT development)
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/livetetConfig.cmake.in
    ${PROJECT_BINARY_DIR}/livetetConfig.cmake INSTALL_DESTINATION ${package})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/livetetConfigVersion.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/livetetConfig.cmake ${PROJECT_BINARY_DIR}/livetetConfigVersion.cmake
    ${PROJECT_SOURCE_DIR}/cmake/dependencies.cmake DESTINATION ${package} COMPONENT development)
endfunction()
