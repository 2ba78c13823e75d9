# Finds CMock (which brings Unity, its runner generator and the mock generator) and defines pfl_unity_test().
# Looked for in CMOCK_ROOT, then in the installed package, then, when PFLIGHT_FETCH_TEST_DEPS is on, upstream.

option(PFLIGHT_FETCH_TEST_DEPS "Fetch CMock and Unity from upstream when they are not installed" OFF)
set(CMOCK_ROOT "" CACHE PATH "Folder of CMock: holds lib/cmock.rb, src/cmock.c and vendor/unity")

find_program(PFLIGHT_RUBY ruby)
if(NOT PFLIGHT_RUBY)
  message(FATAL_ERROR "The tests need ruby: run `tools/setup test`, or configure with -DPFLIGHT_BUILD_TESTS=OFF.")
endif()

find_path(PFLIGHT_CMOCK_DIR lib/cmock.rb
  HINTS ${CMOCK_ROOT}
  PATHS /usr/share/cmock /usr/local/share/cmock)
if(PFLIGHT_CMOCK_DIR)
  set(PFLIGHT_UNITY_DIR ${PFLIGHT_CMOCK_DIR}/vendor/unity)
elseif(PFLIGHT_FETCH_TEST_DEPS)
  include(FetchContent)
  # SOURCE_SUBDIR names a folder without a CMakeLists.txt: only the files are wanted, not their builds.
  FetchContent_Declare(cmock GIT_REPOSITORY https://github.com/ThrowTheSwitch/CMock.git GIT_TAG v2.5.3
    GIT_SUBMODULES "" SOURCE_SUBDIR none)
  FetchContent_Declare(unity GIT_REPOSITORY https://github.com/ThrowTheSwitch/Unity.git GIT_TAG v2.5.2
    SOURCE_SUBDIR none)
  FetchContent_MakeAvailable(cmock unity)
  set(PFLIGHT_CMOCK_DIR ${cmock_SOURCE_DIR})
  set(PFLIGHT_UNITY_DIR ${unity_SOURCE_DIR})
else()
  message(FATAL_ERROR "The tests need CMock and Unity: run `tools/setup test`, or configure with "
    "-DCMOCK_ROOT=FOLDER, -DPFLIGHT_FETCH_TEST_DEPS=ON or -DPFLIGHT_BUILD_TESTS=OFF.")
endif()

set(PFLIGHT_CMOCK_RB ${PFLIGHT_CMOCK_DIR}/lib/cmock.rb)
set(PFLIGHT_RUNNER_RB ${PFLIGHT_UNITY_DIR}/auto/generate_test_runner.rb)
set(PFLIGHT_CMOCK_YML ${CMAKE_CURRENT_LIST_DIR}/cmock.yml)

# Unity and CMock are others' code: SYSTEM includes and none of our warning flags.
add_library(pfl_unity STATIC ${PFLIGHT_UNITY_DIR}/src/unity.c ${PFLIGHT_CMOCK_DIR}/src/cmock.c)
target_include_directories(pfl_unity SYSTEM PUBLIC ${PFLIGHT_UNITY_DIR}/src ${PFLIGHT_CMOCK_DIR}/src)
target_compile_definitions(pfl_unity PUBLIC UNITY_SUPPORT_64 UNITY_INCLUDE_DOUBLE CMOCK_MEM_DYNAMIC)
target_compile_options(pfl_unity PRIVATE -w)

# pfl_unity_test(NAME SOURCES test_x.c [more.c]... [MOCKS port.h]... [LIBRARIES lib]... [DEFINITIONS A=1]...
#                [LABELS slow])
#
# One executable, one ctest of the same name. The first source holds the test_ functions; its runner is generated.
# MOCKS names public headers of lib/include/pflight; the test includes "Mockport.h" for port.h.
# LIBRARIES defaults to pflight::pflight and a port: the mock of port.h where there is one, else pflight::port_null.
function(pfl_unity_test name)
  cmake_parse_arguments(arg "" "" "SOURCES;MOCKS;LIBRARIES;DEFINITIONS;LABELS" ${ARGN})
  if(NOT arg_SOURCES OR arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "pfl_unity_test(${name}): expected SOURCES, MOCKS, LIBRARIES, DEFINITIONS, LABELS")
  endif()
  list(GET arg_SOURCES 0 main)
  get_filename_component(main ${main} ABSOLUTE)
  set(dir ${CMAKE_CURRENT_BINARY_DIR}/generated/${name})
  file(MAKE_DIRECTORY ${dir})

  add_custom_command(OUTPUT ${dir}/runner.c
    COMMAND ${PFLIGHT_RUBY} -W0 ${PFLIGHT_RUNNER_RB} ${main} ${dir}/runner.c
    DEPENDS ${main} VERBATIM)
  set(generated ${dir}/runner.c)
  foreach(header ${arg_MOCKS})
    get_filename_component(stem ${header} NAME_WE)
    add_custom_command(OUTPUT ${dir}/Mock${stem}.c ${dir}/Mock${stem}.h
      COMMAND ${PFLIGHT_RUBY} -W0 ${PFLIGHT_CMOCK_RB} -o${PFLIGHT_CMOCK_YML} --mock_path=${dir}
        ${PFLIGHT_INCLUDE_DIR}/pflight/${stem}.h
      DEPENDS ${PFLIGHT_INCLUDE_DIR}/pflight/${stem}.h ${PFLIGHT_CMOCK_YML} VERBATIM)
    list(APPEND generated ${dir}/Mock${stem}.c)
  endforeach()

  if(NOT arg_LIBRARIES)
    set(arg_LIBRARIES pflight::pflight)
    if(NOT "port.h" IN_LIST arg_MOCKS)
      list(APPEND arg_LIBRARIES pflight::port_null)
    endif()
  endif()

  # The generated files are built apart, so that our warning flags hold for our files only.
  add_library(${name}_generated OBJECT ${generated})
  target_include_directories(${name}_generated PRIVATE ${dir} ${PFLIGHT_INCLUDE_DIR} ${CMAKE_CURRENT_SOURCE_DIR}/unit)
  target_compile_definitions(${name}_generated PRIVATE ${arg_DEFINITIONS})
  target_compile_options(${name}_generated PRIVATE -w)
  target_link_libraries(${name}_generated PRIVATE pfl_unity)

  add_executable(${name} ${arg_SOURCES} $<TARGET_OBJECTS:${name}_generated>)
  add_dependencies(${name} ${name}_generated)
  target_include_directories(${name} SYSTEM PRIVATE ${dir})
  target_include_directories(${name} PRIVATE ${PFLIGHT_INCLUDE_DIR} ${CMAKE_CURRENT_SOURCE_DIR}/unit)
  target_compile_definitions(${name} PRIVATE ${arg_DEFINITIONS})
  target_compile_options(${name} PRIVATE ${PFLIGHT_WARNINGS} ${PFLIGHT_COMPILE_OPTIONS})
  target_link_libraries(${name} PRIVATE ${arg_LIBRARIES} pfl_unity m)
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES TIMEOUT 600 LABELS "${arg_LABELS}")
endfunction()
