# pfl_bare_metal(IMAGE [NO_STARTUP]): start-up code, linker script and memory of the toolchain file's board for an executable.
if(NOT PFLIGHT_BOARD_STACK_BYTES)
  set(PFLIGHT_BOARD_STACK_BYTES 0x2000)
endif()

function(pfl_bare_metal image)
  if(NOT "NO_STARTUP" IN_LIST ARGN) # it has its own
    target_sources(${image} PRIVATE ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/board/startup_${PFLIGHT_BOARD}.c)
  endif()
  target_compile_options(${image} PRIVATE -ffunction-sections -fdata-sections)
  target_link_options(${image} PRIVATE -nostartfiles -T ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/board/${PFLIGHT_BOARD}.ld
    -Wl,--gc-sections,-Map=$<TARGET_FILE:${image}>.map,--no-warn-rwx-segments
    -Wl,--defsym=BOARD_FLASH=${PFLIGHT_BOARD_FLASH},--defsym=BOARD_FLASH_BYTES=${PFLIGHT_BOARD_FLASH_BYTES}
    -Wl,--defsym=BOARD_RAM=${PFLIGHT_BOARD_RAM},--defsym=BOARD_RAM_BYTES=${PFLIGHT_BOARD_RAM_BYTES}
    -Wl,--defsym=BOARD_STACK_BYTES=${PFLIGHT_BOARD_STACK_BYTES})
endfunction()
