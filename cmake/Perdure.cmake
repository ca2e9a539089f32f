# Functions by which every folder declares its library, program and tests, with one call each.
include_guard()

add_library(perdure_options INTERFACE)
target_compile_features(perdure_options INTERFACE cxx_std_20)
target_include_directories(perdure_options INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(perdure_options INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual
    -Wimplicit-fallthrough -Wnull-dereference -Wno-psabi>
  $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<BOOL:${PERDURE_WARNINGS_AS_ERRORS}>>:-Werror>
  # GCC 12 gives false warnings in Release builds, inside inlined code of Eigen and the standard
  # library.
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<COMPILE_LANGUAGE:CXX>>:-Wno-maybe-uninitialized -Wno-array-bounds
    -Wno-stringop-overflow -Wno-stringop-overread -Wno-null-dereference -Wno-restrict>
  # GCC collects garbage only above 500 MB, not 128 MB. This saves a tenth of its time.
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<COMPILE_LANGUAGE:CXX>>:--param=ggc-min-heapsize=500000>)

# The gold linker needs a fifth of the time, because the libraries of OpenCV depend on hundreds of
# others.
include(CheckLinkerFlag)
check_linker_flag(CXX -fuse-ld=gold PERDURE_GOLD)
if(PERDURE_GOLD)
  add_link_options(-fuse-ld=gold)
endif()

# Precompiles the headers that nearly every file includes, which saves three seconds per file. Code
# for modules (perdure_loadable) needs its own precompiled headers. So does code with another
# optimisation level (perdure_fast), because GCC would silently use the level of the header.
file(GENERATE OUTPUT ${PROJECT_BINARY_DIR}/common_headers.cpp CONTENT "")
foreach(kind common fast loadable fast_loadable)
  add_library(perdure_${kind}_headers STATIC ${PROJECT_BINARY_DIR}/common_headers.cpp)
  target_link_libraries(perdure_${kind}_headers PRIVATE perdure_options Eigen3::Eigen)
  target_precompile_headers(perdure_${kind}_headers PRIVATE <Eigen/Core> <Eigen/Geometry>
    <algorithm> <chrono> <functional> <map> <memory> <string> <tl/expected.hpp> <vector>)
endforeach()
foreach(kind loadable fast_loadable)
  set_target_properties(perdure_${kind}_headers PROPERTIES POSITION_INDEPENDENT_CODE ON)
  target_compile_options(perdure_${kind}_headers PRIVATE -fno-semantic-interposition)
endforeach()
foreach(kind fast fast_loadable)
  target_compile_options(perdure_${kind}_headers PRIVATE $<$<CONFIG:Release>:-O3>)
endforeach()

# Compiles the files of a target in batches. This takes a third of the time if many small files
# include the same large headers. Names in unnamed namespaces must then differ within the target.
function(perdure_together name)
  set_target_properties(${name} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
  # GCC treats a file of a batch as a header, and warns about structs defined there.
  target_compile_options(${name} PRIVATE
    $<$<AND:$<CXX_COMPILER_ID:GNU>,$<COMPILE_LANGUAGE:CXX>>:-Wno-subobject-linkage>)
endfunction()

# perdure_library(NAME SOURCES … DEPENDS … [TOGETHER]): a static library. NAME is the folder with
# underscores. TOGETHER compiles its files in batches.
function(perdure_library name)
  cmake_parse_arguments(ARG "TOGETHER" "" "SOURCES;DEPENDS" ${ARGN})
  if(ARG_SOURCES)
    add_library(${name} STATIC ${ARG_SOURCES})
    target_link_libraries(${name} PUBLIC perdure_options ${ARG_DEPENDS})
    target_precompile_headers(${name} REUSE_FROM perdure_common_headers)
    if(ARG_TOGETHER)
      perdure_together(${name})
    endif()
  else()
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE perdure_options ${ARG_DEPENDS})
  endif()
endfunction()

# perdure_program(NAME SOURCES … DEPENDS …): an executable in bin/, compiled in batches.
function(perdure_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE perdure_options ${ARG_DEPENDS})
  target_precompile_headers(${name} REUSE_FROM perdure_common_headers)
  list(LENGTH ARG_SOURCES files)
  if(files GREATER 1)
    perdure_together(${name})
  endif()
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
endfunction()

# perdure_command(NAME DEPENDS …): the executable of `perdure NAME`, in libexec/perdure. Its target
# is perdure-command-NAME. A library in DEPENDS defines the setUp function of the subcommand
# (tools/perdure/commands.h).
add_custom_target(perdure_commands)
function(perdure_command name)
  cmake_parse_arguments(ARG "" "" "DEPENDS" ${ARGN})
  string(SUBSTRING ${name} 0 1 initial)
  string(SUBSTRING ${name} 1 -1 rest)
  string(TOUPPER ${initial} initial)
  set(main ${CMAKE_CURRENT_BINARY_DIR}/${name}_main.cpp)
  file(GENERATE OUTPUT ${main} CONTENT "#include \"tools/perdure/commands.h\"

int main(int argc, char** argv) {
  return perdure::tools::runCommand(\"${name}\", &perdure::tools::setUp${initial}${rest}, argc, argv);
}
")
  add_executable(perdure-command-${name} ${main})
  target_link_libraries(perdure-command-${name} PRIVATE perdure_command_line ${ARG_DEPENDS})
  set_target_properties(perdure-command-${name} PROPERTIES OUTPUT_NAME ${name}
    RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/libexec/perdure)
  add_dependencies(perdure_commands perdure-command-${name})
  set_property(GLOBAL APPEND PROPERTY PERDURE_COMMANDS perdure-command-${name})
endfunction()

# Targets that no test of `tests/run` needs are built by name, or all together as `long_tests`.
# These are the benchmarks and the targets that only tests labelled long use.
add_custom_target(long_tests)
function(perdure_only_when_asked name)
  set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL ON)
  add_dependencies(long_tests ${name})
endfunction()

# perdure_benchmark(NAME SOURCES … DEPENDS … [SMOKE ARGS…]): an executable in bench/, built on
# request only. SMOKE: a test labelled long runs the benchmark with these arguments.
function(perdure_benchmark name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS;SMOKE" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE perdure_options ${ARG_DEPENDS})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bench)
  perdure_only_when_asked(${name})
  if(ARG_SMOKE)
    add_test(NAME ${name}_runs COMMAND ${name} ${ARG_SMOKE} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
    set_tests_properties(${name}_runs PROPERTIES LABELS "bench;long" TIMEOUT 300)
  endif()
endfunction()

# Precompiles the headers that every test includes. The files of the tests are optimised less,
# because the code under test is in libraries.
if(PERDURE_BUILD_TESTS)
  file(GENERATE OUTPUT ${PROJECT_BINARY_DIR}/test_headers.cpp CONTENT "")
  add_library(perdure_test_headers STATIC ${PROJECT_BINARY_DIR}/test_headers.cpp)
  target_link_libraries(perdure_test_headers PRIVATE perdure_options GTest::gmock Eigen3::Eigen)
  target_compile_options(perdure_test_headers PRIVATE $<$<CONFIG:Release>:-O1>)
  target_precompile_headers(perdure_test_headers PRIVATE
    <gmock/gmock.h> <gtest/gtest.h> <Eigen/Core> <Eigen/Geometry>)
endif()

# perdure_test_program(NAME SOURCES … DEPENDS …): a GoogleTest program in tests/, compiled in
# batches.
function(perdure_test_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE perdure_options ${ARG_DEPENDS} GTest::gmock GTest::gtest_main)
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  target_precompile_headers(${name} REUSE_FROM perdure_test_headers)
  list(LENGTH ARG_SOURCES files)
  if(files GREATER 1)
    perdure_together(${name})
  endif()
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
endfunction()

# perdure_test(NAME SOURCES … DEPENDS … [LABELS …] [TIMEOUT s] [ARGS …]): a GoogleTest program with
# one ctest entry. Labels: unit (default), process, scenario, golden, fuzz, data, long.
function(perdure_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "SOURCES;DEPENDS;LABELS;ARGS;ENVIRONMENT" ${ARGN})
  if(NOT PERDURE_BUILD_TESTS)
    return()
  endif()
  perdure_test_program(${name} SOURCES ${ARG_SOURCES} DEPENDS ${ARG_DEPENDS})
  add_test(NAME ${name} COMMAND ${name} ${ARG_ARGS} WORKING_DIRECTORY ${PROJECT_SOURCE_DIR})
  if(NOT ARG_LABELS)
    set(ARG_LABELS unit)
  elseif(long IN_LIST ARG_LABELS)
    perdure_only_when_asked(${name})
  endif()
  # The time limit ends a test that hangs. On a loaded machine a test may take six times as long.
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  set_tests_properties(${name} PROPERTIES LABELS "${ARG_LABELS}" TIMEOUT ${ARG_TIMEOUT}
    ENVIRONMENT "PERDURE_BIN=${PROJECT_BINARY_DIR}/bin;PERDURE_SOURCE=${PROJECT_SOURCE_DIR};${ARG_ENVIRONMENT}")
endfunction()

# perdure_fast(NAME): a library that takes much of the run time on a vehicle.
function(perdure_fast name)
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O3>)
  set_target_properties(${name} PROPERTIES PRECOMPILE_HEADERS_REUSE_FROM perdure_fast_headers)
  add_dependencies(${name} perdure_fast_headers)
endfunction()

# perdure_loadable(TARGETS…): libraries that are linked into a module, which another program loads.
# Calls within these libraries stay direct, as in programs.
function(perdure_loadable)
  foreach(target ${ARGN})
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    target_compile_options(${target} PRIVATE -fno-semantic-interposition)
    get_target_property(reused ${target} PRECOMPILE_HEADERS_REUSE_FROM)
    if(reused)
      string(REGEX REPLACE "_(common_)?headers$" "_loadable_headers" headers ${reused})
      set_target_properties(${target} PROPERTIES PRECOMPILE_HEADERS_REUSE_FROM ${headers})
      add_dependencies(${target} ${headers})
    endif()
  endforeach()
endfunction()
