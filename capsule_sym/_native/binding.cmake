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

# A core for each scene, beside its generated code, or for one in a folder of its own.
if(SKBUILD)
    file(GLOB FOUND LIST_DIRECTORIES TRUE CONFIGURE_DEPENDS ${GENERATED}/*/c)
else()
    set(FOUND ${CAPSULE_SCENE}/c)
endif()
foreach(KERNELS ${FOUND})
    set(SCENE own)
    set(PLACE .)
    if(SKBUILD)
        get_filename_component(SCENE ${KERNELS} DIRECTORY)
        get_filename_component(SCENE ${SCENE} NAME)
        set(PLACE capsule_sym/generated/${SCENE})
    endif()
    set(LIBRARY capsule_${SCENE})
    add_library(${LIBRARY} STATIC ${SOURCES} ${KERNELS}/capsule_kernels.c)
    capsule_settings(${LIBRARY} ${KERNELS})

    set(BINDING ${CMAKE_CURRENT_BINARY_DIR}/${SCENE}/_core.c)
    add_custom_command(
        OUTPUT ${BINDING}
        COMMAND Python::Interpreter -m cython -3 -I ${KERNELS} ${CMAKE_CURRENT_SOURCE_DIR}/_core.pyx -o ${BINDING}
        DEPENDS _core.pyx ${KERNELS}/capsule_interface.pxi)
    Python_add_library(core_${SCENE} MODULE WITH_SOABI ${INTERFACE} ${BINDING})
    set_target_properties(core_${SCENE} PROPERTIES OUTPUT_NAME _core
        LIBRARY_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/${SCENE})
    target_compile_options(core_${SCENE} PRIVATE ${STRICT})
    target_link_libraries(core_${SCENE} PRIVATE ${LIBRARY})
    install(TARGETS core_${SCENE} DESTINATION ${PLACE})
endforeach()
