find_package(Threads REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(OpenCV REQUIRED COMPONENTS core imgproc imgcodecs videoio video calib3d features2d dnn)
find_package(TBB REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)
find_package(CGAL REQUIRED)
find_package(Boost REQUIRED)

# Each package as one imported target whose headers are system headers (their warnings are not ours).
add_library(palpate_opencv INTERFACE)
target_include_directories(palpate_opencv SYSTEM INTERFACE ${OpenCV_INCLUDE_DIRS})
target_link_libraries(palpate_opencv INTERFACE ${OpenCV_LIBS})

# FFmpeg's own libraries tell the time of every frame; OpenCV's VideoCapture does not.
find_package(PkgConfig REQUIRED)
find_package(ZLIB REQUIRED)
find_package(LibLZMA REQUIRED)
pkg_check_modules(LZ4 REQUIRED IMPORTED_TARGET liblz4)
pkg_check_modules(LIBAV REQUIRED IMPORTED_TARGET libavformat libavcodec libswscale libavutil)
pkg_check_modules(GSTREAMER REQUIRED IMPORTED_TARGET gstreamer-app-1.0 gstreamer-video-1.0)

find_path(SUITESPARSE_INCLUDE cholmod.h PATH_SUFFIXES suitesparse REQUIRED)
find_library(CHOLMOD_LIBRARY cholmod REQUIRED)
find_library(OPENBLAS_LIBRARY openblas REQUIRED)
add_library(palpate_cholmod INTERFACE)
target_include_directories(palpate_cholmod SYSTEM INTERFACE ${SUITESPARSE_INCLUDE})
target_link_libraries(palpate_cholmod INTERFACE ${CHOLMOD_LIBRARY} ${OPENBLAS_LIBRARY})

# Debian 12 ships Embree 3, Ubuntu 24.04 Embree 4; the few calls we make differ only in their header.
find_package(embree 4 QUIET)
if(NOT embree_FOUND)
  find_package(embree 3 REQUIRED)
endif()

# OpenIGTLink's own USE_FILE would change the compiler's flags for everything.
find_path(OPENIGTLINK_INCLUDE igtlMessageBase.h PATH_SUFFIXES openigtlink REQUIRED)
find_library(OPENIGTLINK_LIBRARY OpenIGTLink REQUIRED)
add_library(palpate_openigtlink INTERFACE)
target_include_directories(palpate_openigtlink SYSTEM INTERFACE ${OPENIGTLINK_INCLUDE})
target_link_libraries(palpate_openigtlink INTERFACE ${OPENIGTLINK_LIBRARY})

find_package(CycloneDDS REQUIRED)
find_program(IDLC idlc REQUIRED)

find_path(CMARK_INCLUDE cmark-gfm-core-extensions.h REQUIRED)
find_library(CMARK_LIBRARY cmark-gfm REQUIRED)
find_library(CMARK_EXTENSIONS_LIBRARY cmark-gfm-extensions REQUIRED)
add_library(palpate_cmark INTERFACE)
target_include_directories(palpate_cmark SYSTEM INTERFACE ${CMARK_INCLUDE})
target_link_libraries(palpate_cmark INTERFACE ${CMARK_EXTENSIONS_LIBRARY} ${CMARK_LIBRARY})

# Debian's own Python, unless Python_EXECUTABLE says otherwise.
if(PALPATE_PYTHON)
  if(NOT Python_EXECUTABLE AND EXISTS /usr/bin/python3)
    set(Python_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "Python that the module is for")
  endif()
  find_package(Python REQUIRED COMPONENTS Interpreter Development.Module)
  find_package(pybind11 REQUIRED CONFIG)
endif()
