# What others build on: one shared library of all that images become forces by, its headers, and what CMake finds it with.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# `headers` of Palpate and all of Palpate's that they include.
function(palpate_headers result)
  set(todo ${ARGN})
  set(headers "")
  while(todo)
    list(POP_FRONT todo header)
    if(NOT header IN_LIST headers)
      list(APPEND headers ${header})
      set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${header})
      file(STRINGS ${PROJECT_SOURCE_DIR}/${header} includes REGEX "^#include \"palpate/")
      list(TRANSFORM includes REPLACE "^#include \"(.*)\".*" "\\1")
      list(APPEND todo ${includes})
    endif()
  endwhile()
  set(${result} ${headers} PARENT_SCOPE)
endfunction()

list(TRANSFORM PALPATE_SHARED_FOLDERS REPLACE "(.+)" "$<TARGET_OBJECTS:palpate_\\1>" OUTPUT_VARIABLE objects)
list(TRANSFORM PALPATE_SHARED_FOLDERS PREPEND palpate_ OUTPUT_VARIABLE libraries)
add_library(palpate_shared SHARED ${objects})
target_link_libraries(palpate_shared PUBLIC Eigen3::Eigen opencv_core PRIVATE ${libraries})
target_include_directories(palpate_shared PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
                                                 $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_compile_features(palpate_shared PUBLIC cxx_std_20)
if(PALPATE_NATIVE)
  target_compile_options(palpate_shared PUBLIC -march=native)  # as in palpate_folder
endif()
# Only namespace palpate is to be seen: other libraries' templates stay inside.
set(symbols ${PROJECT_SOURCE_DIR}/cmake/palpate_symbols.map)
target_link_options(palpate_shared PRIVATE LINKER:--version-script=${symbols} LINKER:-Bsymbolic-functions)
set_target_properties(palpate_shared PROPERTIES OUTPUT_NAME palpate EXPORT_NAME palpate LINKER_LANGUAGE CXX
                      VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
                      LINK_DEPENDS ${symbols})

palpate_headers(headers palpate/palpate.h palpate/contact/equilibrium.h palpate/core/mesh_files.h
                palpate/estimate/build_stages.h palpate/feedback/compare.h palpate/feedback/forces_file.h
                palpate/feedback/overlay.h palpate/simulate/dejavu.h palpate/volume/tetrahedralize.h)
foreach(header ${headers})
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES ${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${folder} COMPONENT dev)
endforeach()

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/palpate)
install(TARGETS palpate_shared EXPORT palpate LIBRARY COMPONENT library NAMELINK_COMPONENT dev)
install(EXPORT palpate NAMESPACE palpate:: FILE palpateTargets.cmake DESTINATION ${package} COMPONENT dev)
configure_package_config_file(cmake/palpateConfig.cmake.in palpateConfig.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(palpateConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/palpateConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/palpateConfigVersion.cmake
        DESTINATION ${package} COMPONENT dev)

install(TARGETS palpate_program COMPONENT program)
# The operator's page, where it has been built (./dev console, ./dev package).
install(DIRECTORY ${PROJECT_BINARY_DIR}/share/palpate DESTINATION ${CMAKE_INSTALL_DATADIR} COMPONENT program OPTIONAL)
set(man_page ${PROJECT_BINARY_DIR}/palpate.1.gz)
set(write_man_page ${PROJECT_SOURCE_DIR}/docs/write_man_page)
add_custom_command(OUTPUT ${man_page} DEPENDS ${write_man_page} palpate_program VERBATIM
                   COMMAND ${write_man_page} $<TARGET_FILE:palpate_program> ${man_page})
add_custom_target(palpate_man_page ALL DEPENDS ${man_page})
install(FILES ${man_page} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
