# One folder = one idea = one static library. Headers stand beside sources and are included as "palpate/<folder>/<file>.h".
#
#   palpate_folder(stereo PUBLIC palpate_core PRIVATE TBB::tbb)
#
# What is below the streams goes into the shared library that is installed too (palpate_install.cmake).
set(PALPATE_SHARED_FOLDERS core stereo surface volume elastic instrument observe contact infer estimate simulate feedback)

# GCC 12 warns falsely inside std::string (-Wrestrict, GCC bug 105651; from precompiled headers, which it no longer knows for
# the system's, also of its memory) and the AVX-512 headers (GCC bug 105593).
function(palpate_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wno-psabi -Wno-restrict -Wno-maybe-uninitialized
                                           -Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread)
  if(PALPATE_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()

# What most files include is read once; it takes longer than most files themselves. `kind`: library (position independent, as
# those of PALPATE_SHARED_FOLDERS), program, test.
set(PALPATE_PRECOMPILED <Eigen/Core> <Eigen/Geometry> <algorithm> <array> <cmath> <filesystem> <functional> <map> <memory>
                        <opencv2/core.hpp> <optional> <string> <vector> <fmt/format.h>)
function(palpate_precompile target kind)
  if(NOT PALPATE_PCH)
    return()
  endif()
  set(headers palpate_precompiled_${kind})
  if(NOT TARGET ${headers})
    file(WRITE ${PROJECT_BINARY_DIR}/${headers}.cpp "")
    add_library(${headers} STATIC ${PROJECT_BINARY_DIR}/${headers}.cpp)
    target_link_libraries(${headers} PRIVATE Eigen3::Eigen palpate_opencv fmt::fmt)
    target_compile_features(${headers} PUBLIC cxx_std_20)
    palpate_warnings(${headers})  # the same: -Wpedantic defines macros
    target_precompile_headers(${headers} PRIVATE ${PALPATE_PRECOMPILED})
    if(kind STREQUAL library)
      set_target_properties(${headers} PROPERTIES POSITION_INDEPENDENT_CODE ON)
      target_compile_options(${headers} PRIVATE -fno-semantic-interposition)
    elseif(kind STREQUAL test)
      target_link_libraries(${headers} PRIVATE GTest::gtest GTest::gmock)
      target_precompile_headers(${headers} PRIVATE <gmock/gmock.h> <gtest/gtest.h>)
    endif()
    if(PALPATE_NATIVE)
      target_compile_options(${headers} PRIVATE -march=native)
    endif()
  endif()
  target_precompile_headers(${target} REUSE_FROM ${headers})
endfunction()

function(palpate_folder name)
  cmake_parse_arguments(F "" "" "PUBLIC;PRIVATE" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/palpate/${name}/*.cpp)
  if(NOT sources)
    file(WRITE ${PROJECT_BINARY_DIR}/empty_${name}.cpp "")
    set(sources ${PROJECT_BINARY_DIR}/empty_${name}.cpp)
  endif()
  add_library(palpate_${name} STATIC ${sources})
  target_include_directories(palpate_${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(palpate_${name} PUBLIC ${F_PUBLIC} PRIVATE ${F_PRIVATE})
  target_compile_features(palpate_${name} PUBLIC cxx_std_20)
  if(name IN_LIST PALPATE_SHARED_FOLDERS)
    set_target_properties(palpate_${name} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    target_compile_options(palpate_${name} PRIVATE -fno-semantic-interposition)
    palpate_precompile(palpate_${name} library)
  else()
    palpate_precompile(palpate_${name} program)
  endif()
  # Public, because Eigen aligns memory by it: whoever shares matrices with the library has to agree.
  if(PALPATE_NATIVE)
    target_compile_options(palpate_${name} PUBLIC -march=native)
  endif()
  palpate_warnings(palpate_${name})
endfunction()

# Tests mirror the folders: palpate_tests(stereo) makes test_stereo from tests/stereo/*.cpp.
function(palpate_tests name)
  file(GLOB sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/tests/${name}/*.cpp)
  if(NOT sources)
    return()
  endif()
  add_executable(test_${name} ${sources})
  target_link_libraries(test_${name} PRIVATE ${ARGN} palpate_test_support)
  palpate_warnings(test_${name})
  palpate_precompile(test_${name} test)
  gtest_discover_tests(test_${name} PROPERTIES LABELS ${name} DISCOVERY_TIMEOUT 60
                       DISCOVERY_MODE PRE_TEST)
endfunction()
