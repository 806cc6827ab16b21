# Python's binding of cores, which knows no scene, and cores of scenes beside their generated code. It
# is by Python's stable interface where the build asks for that: then one module serves all Pythons from
# SKBUILD_SABI_VERSION on.
cmake_minimum_required(VERSION 3.26)
if(SKBUILD_SABI_VERSION)
    find_package(Python REQUIRED COMPONENTS Interpreter Development.SABIModule)
    set(INTERFACE USE_SABI ${SKBUILD_SABI_VERSION})
else()
    find_package(Python REQUIRED COMPONENTS Interpreter Development.Module)
    set(INTERFACE "")
endif()

set(BINDING ${CMAKE_CURRENT_BINARY_DIR}/_binding.c)
add_custom_command(
    OUTPUT ${BINDING}
    COMMAND Python::Interpreter -m cython -3 ${CMAKE_CURRENT_SOURCE_DIR}/_binding.pyx -o ${BINDING}
    DEPENDS _binding.pyx)
Python_add_library(_binding MODULE WITH_SOABI ${INTERFACE} ${BINDING})
target_include_directories(_binding PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
# It passes arrays on, and is large: it is compiled as fast as it can be.
target_compile_options(_binding PRIVATE ${STRICT} $<$<NOT:$<BOOL:${MSVC}>>:-O1>)
install(TARGETS _binding DESTINATION capsule_sym/_native)

# The other scenes that ship are compiled at their first use.
set(CAPSULE_CORES capsule CACHE STRING "scenes whose cores are compiled, or all")
set(CORES ${CAPSULE_CORES})
if(CORES STREQUAL all)
    file(GLOB CORES RELATIVE ${GENERATED} CONFIGURE_DEPENDS ${GENERATED}/*/c)
    list(TRANSFORM CORES REPLACE "/c$" "")
endif()
foreach(SCENE ${CORES})
    add_library(core_${SCENE} MODULE ${SOURCES} ${GENERATED}/${SCENE}/c/capsule_kernels.c)
    capsule_settings(core_${SCENE} ${GENERATED}/${SCENE}/c)
    # Elsewhere `capsule_core` is exported, and no more: calls within the library stay within it, whatever
    # else is loaded.
    if(WIN32)
        target_compile_definitions(core_${SCENE} PRIVATE CAPSULE_EXPORTS)
        set(SUFFIX .dll)
    else()
        set(SUFFIX .so.1) # no module for Python
    endif()
    set_target_properties(core_${SCENE} PROPERTIES PREFIX "" OUTPUT_NAME core SUFFIX ${SUFFIX}
        LIBRARY_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/${SCENE})
    install(TARGETS core_${SCENE} DESTINATION capsule_sym/generated/${SCENE})
endforeach()
