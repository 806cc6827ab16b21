# Python's binding, by its stable interface where the build asks for that: then one module serves all
# Pythons from SKBUILD_SABI_VERSION on.
cmake_minimum_required(VERSION 3.26)
if(SKBUILD_SABI_VERSION)
    find_package(Python REQUIRED COMPONENTS Interpreter Development.SABIModule)
    set(INTERFACE USE_SABI ${SKBUILD_SABI_VERSION})
else()
    find_package(Python REQUIRED COMPONENTS Interpreter Development.Module)
    set(INTERFACE "")
endif()

add_library(capsule STATIC ${SOURCES})
capsule_settings(capsule)

set(BINDING ${CMAKE_CURRENT_BINARY_DIR}/_core.c)
add_custom_command(
    OUTPUT ${BINDING}
    COMMAND Python::Interpreter -m cython -3 -I ${KERNELS} ${CMAKE_CURRENT_SOURCE_DIR}/_core.pyx -o ${BINDING}
    DEPENDS _core.pyx ${KERNELS}/capsule_interface.pxi)
Python_add_library(_core MODULE WITH_SOABI ${INTERFACE} ${BINDING})
target_compile_options(_core PRIVATE ${STRICT})
target_link_libraries(_core PRIVATE capsule)
install(TARGETS _core DESTINATION capsule_sym/_native)
