# What `cmake --install` installs: the program with what it shares (share.cmake), the runtime library with its
# headers, and the files by which other projects find it: find_package(refdyn) gives the targets refdyn::runtime,
# refdyn::batch and refdyn::shared and the function refdyn_generate (generate.cmake), pkg-config the packages refdyn
# and refdyn-shared; with GSL also refdyn::gsl and refdyn-gsl.
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/refdyn)

if(TARGET refdyn)
    install(TARGETS refdyn)
endif()
if(TARGET refdyn_runtime)
    install(TARGETS refdyn_runtime refdyn_batch EXPORT refdyn)
    install(FILES ${batch_header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/refdyn)
    if(TARGET refdyn_gsl)
        install(TARGETS refdyn_gsl EXPORT refdyn)
        install(FILES ${gsl_header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/refdyn)
    endif()
    if(TARGET refdyn_shared)
        install(TARGETS refdyn_shared EXPORT refdyn)
    endif()
    install(EXPORT refdyn NAMESPACE refdyn:: FILE refdynTargets.cmake DESTINATION ${package_folder})
endif()
set(program_folder ${CMAKE_INSTALL_BINDIR})
cmake_path(APPEND CMAKE_INSTALL_INCLUDEDIR refdyn OUTPUT_VARIABLE header_folder)
configure_package_config_file(runtime/refdynConfig.cmake.in ${PROJECT_BINARY_DIR}/refdynConfig.cmake
                              INSTALL_DESTINATION ${package_folder} PATH_VARS program_folder header_folder)
install(FILES ${PROJECT_BINARY_DIR}/refdynConfig.cmake DESTINATION ${package_folder})
install(FILES runtime/generate.cmake DESTINATION ${package_folder} RENAME refdynGenerate.cmake)
install(FILES ${runtime_headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/refdyn)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

# ARCH_INDEPENDENT: emitted C is for every machine; refdynConfig.cmake checks for which machine the libraries are.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/refdynConfigVersion.cmake COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
install(FILES ${PROJECT_BINARY_DIR}/refdynConfigVersion.cmake DESTINATION ${package_folder})

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
set(pc_libraries -lrefdyn_runtime)
if(TARGET refdyn_batch) # batches and derivatives of motions need POSIX threads
    set(pc_libraries "-lrefdyn_batch -lrefdyn_runtime -pthread")
endif()
configure_file(runtime/refdyn.pc.in refdyn.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/refdyn.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
if(TARGET refdyn_shared)
    configure_file(runtime/refdyn-shared.pc.in refdyn-shared.pc @ONLY)
    install(FILES ${PROJECT_BINARY_DIR}/refdyn-shared.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endif()
if(TARGET refdyn_gsl)
    configure_file(runtime/bindings/gsl/refdyn-gsl.pc.in refdyn-gsl.pc @ONLY)
    install(FILES ${PROJECT_BINARY_DIR}/refdyn-gsl.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endif()
