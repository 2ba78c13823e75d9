# Cortex-M55 with Helium: Arm MPS3 with AN547 (QEMU mps3-an547), 512 KB of ITCM, 512 KB of DTCM.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY) # no C library to link against
set(CMAKE_C_FLAGS_INIT "-mcpu=cortex-m55 -mthumb -mfloat-abi=hard")
set(PFLIGHT_BOARD cortex_m)
set(PFLIGHT_BOARD_FLASH 0x00000000)
set(PFLIGHT_BOARD_FLASH_BYTES 0x80000)
set(PFLIGHT_BOARD_RAM 0x20000000)
set(PFLIGHT_BOARD_RAM_BYTES 0x80000)
set(PFLIGHT_BOARD_PORT "null") # its timers are elsewhere; the plugin counts
