# Cortex-M4F: STM32F405 (QEMU netduinoplus2), 1 MB flash, 128 KB of SRAM; its CCM is not modelled.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY) # no C library to link against
set(CMAKE_C_FLAGS_INIT "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mthumb -mfloat-abi=hard")
set(PFLIGHT_BOARD cortex_m)
set(PFLIGHT_BOARD_FLASH 0x08000000)
set(PFLIGHT_BOARD_FLASH_BYTES 0x100000)
set(PFLIGHT_BOARD_RAM 0x20000000)
set(PFLIGHT_BOARD_RAM_BYTES 0x20000)
set(PFLIGHT_BOARD_PORT qemu)
