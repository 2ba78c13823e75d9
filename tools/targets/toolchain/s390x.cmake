# s390x Linux, big-endian, for user emulation. -std=c99 would make it evaluate floats as doubles.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR s390x)
set(CMAKE_C_COMPILER s390x-linux-gnu-gcc)
set(CMAKE_C_FLAGS_INIT "-fexcess-precision=fast")
set(CMAKE_EXE_LINKER_FLAGS_INIT -static)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(PFLIGHT_BOARD_PORT "null") # no counter: the plugin counts
