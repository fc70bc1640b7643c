# The libraries that Livetet's own are linked with: found here for this build, and again by livetetConfig.cmake for a program
# that links the installed package. Needs LIVETET_IMAGES and LIVETET_PETSC.

# Imported target `name` of a system library without a CMake package.
function(livetet_system_library name library)
  if(NOT TARGET ${name})
    string(MAKE_C_IDENTIFIER LIVETET_${library}_LIBRARY variable)
    find_library(${variable} ${library} REQUIRED)
    add_library(${name} UNKNOWN IMPORTED)
    set_target_properties(${name} PROPERTIES IMPORTED_LOCATION ${${variable}})
  endif()
endfunction()

find_package(PkgConfig REQUIRED)
find_package(MPI REQUIRED COMPONENTS C)
pkg_check_modules(PETSC REQUIRED IMPORTED_TARGET ${LIVETET_PETSC})
pkg_search_module(HDF5 REQUIRED IMPORTED_TARGET hdf5-openmpi hdf5)  # Debian's name, and that of others
find_package(Eigen3 REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(ZLIB REQUIRED)
find_package(Threads REQUIRED)
livetet_system_library(livetet::metis metis)
if(LIVETET_IMAGES)
  find_package(X11 REQUIRED)
  find_package(VTK 9.1 REQUIRED COMPONENTS
    ChartsCore CommonColor FiltersCore FiltersGeneral FiltersGeometry FiltersModeling FiltersSources IOGeometry IOImage IOLegacy IOOggTheora IOPLY
    IOXML ImagingCore ImagingGeneral ImagingStatistics InteractionStyle InteractionWidgets RenderingAnnotation
    RenderingContextOpenGL2 RenderingFreeType RenderingImage RenderingOpenGL2 RenderingUI RenderingVolume RenderingVolumeOpenGL2
    ViewsContext2D)
  # ITK's package file requires every library that ITK was built with, a second HDF5 among them: only these are needed.
  set(LIVETET_ITK_LIBRARIES "")
  foreach(module ITKIONRRD ITKIOMeta ITKMetaIO ITKIOImageBase ITKCommon itkvnl itksys)
    livetet_system_library(livetet::${module} ${module}-5.2)
    list(APPEND LIVETET_ITK_LIBRARIES livetet::${module})
  endforeach()
  # GDCM's package file may require its VTK classes, which are packaged apart.
  set(LIVETET_GDCM_LIBRARIES "")
  foreach(module MSFF DSED Common)
    livetet_system_library(livetet::gdcm${module} gdcm${module})
    list(APPEND LIVETET_GDCM_LIBRARIES livetet::gdcm${module})
  endforeach()
  set(CGAL_DO_NOT_WARN_ABOUT_CMAKE_BUILD_TYPE TRUE)
  find_package(CGAL REQUIRED)
endif()
