# `cmake --build build/release --target package`: a Debian package of this build, the source as an archive, and a wheel,
# in the folder `package` of the build. The target is written out, since the one of include(CPack) makes one of the three.
set(package_folder_of_build ${PROJECT_BINARY_DIR}/package)
set(REFDYN_MAINTAINER "The Refdyn authors <authors@refdyn.invalid>" CACHE STRING "who answers for the Debian package")
set(contained)
if(LAPACKE_archives)
    list(APPEND contained liblapacke-dev)
endif()
if(HDF5_archives)
    list(APPEND contained libhdf5-dev libaec-dev zlib1g-dev)
endif()
configure_file(runtime/package/debian.cmake.in ${package_folder_of_build}/debian.cmake @ONLY)
file(WRITE ${package_folder_of_build}/triggers "activate-noawait ldconfig\n")
add_custom_target(package
    COMMAND ${CMAKE_CPACK_COMMAND} --config ${package_folder_of_build}/debian.cmake
    COMMAND ${CMAKE_COMMAND} -E rm -rf ${package_folder_of_build}/_CPack_Packages
    COMMAND ${PROJECT_SOURCE_DIR}/runtime/package/make_source ${package_folder_of_build} ${PROJECT_VERSION}
    COMMAND ${PROJECT_SOURCE_DIR}/runtime/bindings/python/make_wheel ${package_folder_of_build}
    VERBATIM USES_TERMINAL)
add_dependencies(package refdyn)
