# The C library as others build against it: by pkg-config, or by CMake's find_package(capsule).
include(CMakePackageConfigHelpers)

get_filename_component(KERNELS ${CAPSULE_SCENE} ABSOLUTE BASE_DIR ${GENERATED})
set(KERNELS ${KERNELS}/c)
if(NOT EXISTS ${KERNELS}/capsule_kernels.c)
    message(FATAL_ERROR "CAPSULE_SCENE = '${CAPSULE_SCENE}': must be capsule, prototype, reaction, "
        "reaction_pulse or slope, or the full path of a folder that the generator wrote")
endif()

# Both are made of the same objects, compiled once. All of the kernels' functions are for others.
add_library(objects OBJECT ${SOURCES} ${KERNELS}/capsule_kernels.c)
capsule_settings(objects ${KERNELS})
target_compile_definitions(objects PRIVATE CAPSULE_EXPORTS)
if(NOT MSVC)
    set_source_files_properties(${KERNELS}/capsule_kernels.c PROPERTIES COMPILE_OPTIONS -fvisibility=default)
endif()

# Programs go on with later versions of the same first two numbers: before 1.0 the interface may
# change with the second one.
add_library(capsule SHARED $<TARGET_OBJECTS:objects>)
set_target_properties(capsule PROPERTIES
    VERSION ${PROJECT_VERSION}
    SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
    WINDOWS_EXPORT_ALL_SYMBOLS ON)
add_library(capsule_static STATIC $<TARGET_OBJECTS:objects>)
if(NOT WIN32) # where the shared one has an import library of that name
    set_target_properties(capsule_static PROPERTIES OUTPUT_NAME capsule)
endif()
foreach(LIBRARY capsule capsule_static)
    capsule_settings(${LIBRARY} ${KERNELS})
endforeach()

install(TARGETS capsule capsule_static EXPORT capsule)
install(FILES capsule.h capsule_core.h ${KERNELS}/capsule_interface.h ${KERNELS}/capsule_kernels.h
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/capsule)

set(PACKAGE ${CMAKE_INSTALL_LIBDIR}/cmake/capsule)
install(EXPORT capsule NAMESPACE capsule:: DESTINATION ${PACKAGE} FILE capsule-config.cmake)
write_basic_package_version_file(capsule-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/capsule-config-version.cmake DESTINATION ${PACKAGE})

# Where it lies says where the rest is, so that an installation may be moved.
set(PKGCONFIG ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
file(RELATIVE_PATH PREFIX /${PKGCONFIG} /)
configure_file(capsule.pc.in capsule.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/capsule.pc DESTINATION ${PKGCONFIG})
