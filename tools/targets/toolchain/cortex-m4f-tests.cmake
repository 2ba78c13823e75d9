# Cortex-M4F for the unit tests: Arm MPS2 with AN386 (QEMU mps2-an386), whose 4 MB of data memory hold their arenas.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_C_FLAGS_INIT "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mthumb -mfloat-abi=hard")
set(PFLIGHT_BOARD cortex_m)
set(PFLIGHT_BOARD_FLASH 0x00000000)
set(PFLIGHT_BOARD_FLASH_BYTES 0x400000)
set(PFLIGHT_BOARD_RAM 0x20000000)
set(PFLIGHT_BOARD_RAM_BYTES 0x400000)
set(PFLIGHT_BOARD_STACK_BYTES 0x40000)
set(CMAKE_CROSSCOMPILING_EMULATOR timeout 300 qemu-system-arm -M mps2-an386 -display none -monitor none -serial none
  -chardev stdio,id=sh -semihosting-config enable=on,target=native,chardev=sh -kernel)
