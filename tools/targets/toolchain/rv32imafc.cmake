# RV32IMAFC: QEMU virt, held to 1 MB of code and 256 KB of data. Its gcc comes without the headers of a C library.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR riscv32)
set(CMAKE_C_COMPILER riscv64-unknown-elf-gcc)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY) # no C library to link against
set(CMAKE_C_FLAGS_INIT "-march=rv32imafc -mabi=ilp32f -msmall-data-limit=0 -ffreestanding -fbuiltin")
set(PFLIGHT_BOARD riscv)
set(PFLIGHT_BOARD_FLASH 0x80000000)
set(PFLIGHT_BOARD_FLASH_BYTES 0x100000)
set(PFLIGHT_BOARD_RAM 0x80100000)
set(PFLIGHT_BOARD_RAM_BYTES 0x40000)
set(PFLIGHT_BOARD_PORT riscv)
