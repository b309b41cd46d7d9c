# A toolchain for CMake: Arm's board MPS2 with a Cortex-M4 (AN386), as QEMU emulates it. Each program is linked with the start
# in cortex_start.c; input and output are by semihosting.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR cortex-m4)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_C_FLAGS_INIT "-mthumb -mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard -ffunction-sections -fdata-sections")
set(CMAKE_EXE_LINKER_FLAGS_INIT
    "--specs=rdimon.specs -nostartfiles -Wl,--gc-sections -T ${CMAKE_CURRENT_LIST_DIR}/cortex_memory.ld ${CMAKE_CURRENT_LIST_DIR}/cortex_start.c")
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
