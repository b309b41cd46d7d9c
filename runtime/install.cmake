# What `cmake --install` installs: the program, the runtime library with its headers, and the files by which
# other projects find it: find_package(refdyn) gives the target refdyn::runtime, pkg-config the package refdyn;
# with GSL also refdyn::gsl and refdyn-gsl.
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/refdyn)

if(TARGET refdyn)
    install(TARGETS refdyn)
endif()
if(TARGET refdyn_runtime)
    install(TARGETS refdyn_runtime refdyn_batch EXPORT refdyn)
    install(FILES runtime/batch/refdyn_batch.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/refdyn)
    if(TARGET refdyn_gsl)
        install(TARGETS refdyn_gsl EXPORT refdyn)
        install(FILES runtime/gsl/refdyn_gsl.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/refdyn)
    endif()
    install(EXPORT refdyn NAMESPACE refdyn:: FILE refdynConfig.cmake DESTINATION ${package_folder})
endif()
install(FILES ${runtime_headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/refdyn)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

write_basic_package_version_file(${CMAKE_BINARY_DIR}/refdynConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/refdynConfigVersion.cmake DESTINATION ${package_folder})

# The prefix follows from where refdyn.pc lies, so that an installed tree can be moved, unless a folder was
# given from the root on.
if(IS_ABSOLUTE ${CMAKE_INSTALL_LIBDIR})
    set(pc_prefix ${CMAKE_INSTALL_PREFIX})
else()
    file(RELATIVE_PATH prefix_from_pc /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
    set(pc_prefix "\${pcfiledir}/${prefix_from_pc}")
endif()
cmake_path(APPEND pc_libdir "\${prefix}" ${CMAKE_INSTALL_LIBDIR})
cmake_path(APPEND pc_includedir "\${prefix}" ${CMAKE_INSTALL_INCLUDEDIR})
configure_file(runtime/refdyn.pc.in refdyn.pc @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/refdyn.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
if(TARGET refdyn_gsl)
    configure_file(runtime/gsl/refdyn-gsl.pc.in refdyn-gsl.pc @ONLY)
    install(FILES ${CMAKE_BINARY_DIR}/refdyn-gsl.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endif()
