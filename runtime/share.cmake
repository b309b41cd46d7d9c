# What the program shares with shells, `man`, editors and users, in share/ of the build as in that of an installation:
# completion and manual page are written by the program itself once it is built, and `refdyn new` finds refdyn.lua
# from where the program lies.
set(shared_texts
    bash share/bash-completion/completions/refdyn ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
    zsh share/zsh/site-functions/_refdyn ${CMAKE_INSTALL_DATADIR}/zsh/site-functions
    fish share/fish/vendor_completions.d/refdyn.fish ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d
    man share/man/man1/refdyn.1 ${CMAKE_INSTALL_MANDIR}/man1)
# A program for another machine does not run here.
if(TARGET refdyn AND (NOT CMAKE_CROSSCOMPILING OR CMAKE_CROSSCOMPILING_EMULATOR))
    while(shared_texts)
        list(POP_FRONT shared_texts form file destination)
        cmake_path(GET file PARENT_PATH folder)
        file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/${folder})
        add_custom_command(TARGET refdyn POST_BUILD COMMAND refdyn completion ${form} -o ${PROJECT_BINARY_DIR}/${file})
        if(PROJECT_IS_TOP_LEVEL)
            install(FILES ${PROJECT_BINARY_DIR}/${file} DESTINATION ${destination})
        endif()
    endwhile()
endif()

configure_file(models/editor/refdyn.lua ${PROJECT_BINARY_DIR}/share/refdyn/models/editor/refdyn.lua COPYONLY)
if(PROJECT_IS_TOP_LEVEL)
    install(DIRECTORY models DESTINATION ${CMAKE_INSTALL_DATADIR}/refdyn FILES_MATCHING PATTERN *.lua PATTERN README.md)
    # The programs of docs/control-in-c.md and controllers.md, with the models that they need.
    install(DIRECTORY docs/control DESTINATION ${CMAKE_INSTALL_DATADIR}/refdyn FILES_MATCHING PATTERN *.c PATTERN *.lua PATTERN *.py)
    install(FILES docs/casadi/arm.lua DESTINATION ${CMAKE_INSTALL_DATADIR}/refdyn/control)
endif()
