# The flags that PX4 gives to all of its code (those of its cmake/px4_add_common_flags.cmake), -Werror among them, and -Os as
# on its boards.
set(CMAKE_C_STANDARD 11)
set(CMAKE_CXX_STANDARD 14)
add_compile_options(
  -g -Os -fdata-sections -ffunction-sections -fomit-frame-pointer -funsafe-math-optimizations -fno-strict-aliasing
  -fno-math-errno -fvisibility=hidden -fno-builtin-printf
  -Wall -Wextra -Werror -Warray-bounds -Wcast-align -Wdisabled-optimization -Wdouble-promotion -Wfatal-errors
  -Wfloat-equal -Wformat-security -Winit-self -Wlogical-op -Wpointer-arith -Wshadow -Wuninitialized -Wunknown-pragmas
  -Wunused-variable -Wunused-but-set-variable -Wno-missing-field-initializers -Wno-unused-parameter
  $<$<COMPILE_LANGUAGE:C>:-fno-common> $<$<COMPILE_LANGUAGE:C>:-Wbad-function-cast>
  $<$<COMPILE_LANGUAGE:C>:-Wnested-externs> $<$<COMPILE_LANGUAGE:C>:-Wstrict-prototypes>
  $<$<COMPILE_LANGUAGE:CXX>:-fno-exceptions> $<$<COMPILE_LANGUAGE:CXX>:-fno-rtti>
  $<$<COMPILE_LANGUAGE:CXX>:-fno-threadsafe-statics> $<$<COMPILE_LANGUAGE:CXX>:-fcheck-new>
  $<$<COMPILE_LANGUAGE:CXX>:-Wreorder>)
