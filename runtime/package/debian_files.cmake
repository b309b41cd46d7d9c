# Finishes the tree of the Debian package, before cpack packs it: the files that Debian's policy asks for.
set(tree ${CPACK_TEMPORARY_INSTALL_DIRECTORY}/usr/share)
set(doc ${tree}/doc/refdyn)
set(source ${CMAKE_CURRENT_LIST_DIR}/../..)

# All licences in one file: Refdyn's own, then those of the libraries whose archives the program contains.
file(READ ${source}/LICENSE text)
string(PREPEND text "Refdyn, its models and the C that it emits:\n\n")
foreach(package IN LISTS CPACK_REFDYN_CONTAINED)
    file(READ /usr/share/doc/${package}/copyright licence)
    string(APPEND text "\n\n---- The program contains code of ${package}:\n\n${licence}")
endforeach()
file(WRITE ${doc}/copyright "${text}")
file(REMOVE ${doc}/LICENSE)

# The changes of Debian's form, at the time of the commit.
set(time "Thu, 01 Jan 1970 00:00:00 +0000")
execute_process(COMMAND git -C ${source} log -1 --format=%aD OUTPUT_VARIABLE committed OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(committed)
    set(time ${committed})
endif()
file(WRITE ${doc}/changes "refdyn (${CPACK_PACKAGE_VERSION}) unstable; urgency=medium

  * Version ${CPACK_PACKAGE_VERSION}; NEWS.md.gz says what is new in it.

 -- ${CPACK_DEBIAN_PACKAGE_MAINTAINER}  ${time}
")

function(pack source target)
    execute_process(COMMAND gzip -9nc ${source} OUTPUT_FILE ${target} COMMAND_ERROR_IS_FATAL ANY)
endfunction()
pack(${source}/CHANGELOG.md ${doc}/NEWS.md.gz)
pack(${doc}/changes ${doc}/changelog.gz)
file(REMOVE ${doc}/changes)
pack(${tree}/man/man1/refdyn.1 ${tree}/man/man1/refdyn.1.gz)
file(REMOVE ${tree}/man/man1/refdyn.1)

# Debian's HDF5 archive needs zlib, which the program then contains, too: its start does not load libraries for files that
# most runs do not read.
file(WRITE ${tree}/lintian/overrides/refdyn "refdyn: embedded-library zlib [usr/bin/refdyn]\n")
