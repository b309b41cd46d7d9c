# REFDYN_STANDALONE: the program contains its libraries, whose archives (libNAME.a) come from the system, and needs the C
# library alone, as the wheel of bindings/python/make_wheel does. Below are the libraries that the archives need in turn.
foreach(name lapack blas sz aec z)
    find_library(contained_${name} ${name} REQUIRED)
endforeach()
target_link_libraries(PkgConfig::LAPACKE INTERFACE ${contained_lapack} ${contained_blas})
target_link_libraries(refdyn_hdf5 INTERFACE ${contained_sz} ${contained_aec} ${contained_z})
target_link_libraries(PkgConfig::MINIZIP INTERFACE ${contained_z})

# `refdyn view` copies three.js into its pages.
set(three_js /usr/share/javascript/three/three.min.js)
if(NOT EXISTS ${three_js})
    message(FATAL_ERROR "${three_js}: not found; install libjs-three")
endif()
install(FILES ${three_js} DESTINATION ${CMAKE_INSTALL_DATADIR}/refdyn)
