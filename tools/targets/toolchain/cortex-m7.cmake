# Cortex-M7 with double precision: Arm MPS2 with AN500 (QEMU mps2-an500), 4 MB of code memory, 4 MB of data memory.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY) # no C library to link against
set(CMAKE_C_FLAGS_INIT "-mcpu=cortex-m7 -mfpu=fpv5-d16 -mthumb -mfloat-abi=hard")
set(PFLIGHT_BOARD cortex_m)
set(PFLIGHT_BOARD_FLASH 0x00000000)
set(PFLIGHT_BOARD_FLASH_BYTES 0x400000)
set(PFLIGHT_BOARD_RAM 0x20000000)
set(PFLIGHT_BOARD_RAM_BYTES 0x400000)
set(PFLIGHT_BOARD_PORT qemu)
set(PFLIGHT_BOARD_DEFINITIONS PFL_PORT_QEMU_CMSDK)
