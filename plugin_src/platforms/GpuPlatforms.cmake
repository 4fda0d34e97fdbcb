# Plugins for the platforms of OpenMM that share its Common kernels: GPU_PLUGINS are those that can be built. They need
# OpenMM's library of the platform, with its headers, and the headers of what it runs on. What they lack is said in
# platforms.txt, which is installed, and never stops the build.

set(COMMON_KERNELS layout noise particles)
list(TRANSFORM COMMON_KERNELS PREPEND "${CMAKE_CURRENT_SOURCE_DIR}/platforms/common/kernels/")
list(TRANSFORM COMMON_KERNELS APPEND ".cc")
set(KERNEL_SOURCES "${CMAKE_CURRENT_BINARY_DIR}/CommonCylinderChainKernelSources.cpp")
set(EMBED_KERNELS "${CMAKE_CURRENT_SOURCE_DIR}/platforms/common/EmbedKernels.cmake")
string(REPLACE ";" "$<SEMICOLON>" COMMON_KERNEL_LIST "${COMMON_KERNELS}")
add_custom_command(
    OUTPUT "${KERNEL_SOURCES}"
    COMMAND "${CMAKE_COMMAND}" "-DOUTPUT=${KERNEL_SOURCES}" "-DKERNELS=${COMMON_KERNEL_LIST}" -P "${EMBED_KERNELS}"
    DEPENDS ${COMMON_KERNELS} "${EMBED_KERNELS}"
    VERBATIM)
set(GPU_PLUGINS "")
set(PLATFORMS_TEXT "")

# A plugin for a platform, from the Common sources and those of its own folder. What the processor does for it, such as
# the binding of linkers, is in the plugin for Reference.
function(add_gpu_plugin name folder library)
    file(GLOB sources CONFIGURE_DEPENDS platforms/common/src/*.cpp platforms/${folder}/src/*.cpp)
    add_library(OpenMMCylinderChain${name} SHARED ${sources} "${KERNEL_SOURCES}")
    target_include_directories(OpenMMCylinderChain${name} PRIVATE
        platforms/common/include platforms/reference/include platforms/${folder}/include)
    target_include_directories(OpenMMCylinderChain${name} SYSTEM PRIVATE ${ARGN})
    target_link_libraries(OpenMMCylinderChain${name} PRIVATE OpenMMCylinderChain OpenMMCylinderChainReference
        CylinderChainMechanics "${library}")
    target_compile_options(OpenMMCylinderChain${name} PRIVATE ${CYLCHAIN_NOT_IN_STEPS} ${CYLCHAIN_WARNING_OPTIONS})
    # Each platform has classes of the same names, and so do these plugins.
    set_target_properties(OpenMMCylinderChain${name} PROPERTIES
        CXX_VISIBILITY_PRESET hidden
        UNITY_BUILD "${CYLCHAIN_UNITY}" UNITY_BUILD_BATCH_SIZE 0
        INSTALL_RPATH "${ORIGIN};${ORIGIN}/..;${ORIGIN}/../../../${OPENMM_RPATH};${ORIGIN}/../../../${OPENMM_RPATH}/plugins${OTHER_RPATH}")
    set(GPU_PLUGINS ${GPU_PLUGINS} OpenMMCylinderChain${name} PARENT_SCOPE)
endfunction()

function(report_platform name sentence)
    message(STATUS "Plugin for ${name}: ${sentence}")
    set(PLATFORMS_TEXT "${PLATFORMS_TEXT}${name}: ${sentence}\n" PARENT_SCOPE)
endfunction()

find_path(OPENMM_COMMON_HEADERS openmm/common/ComputeContext.h HINTS "${OPENMM_INCLUDE}")

# What the platforms run on. That of CUDA is in the packages of NVIDIA that OpenMM's own package for CUDA brings, or in a
# toolkit; nvcc is not needed.

set(PLATFORM_FOLDERS "${OPENMM_LIBRARIES}/plugins")
set(CUDA_FOLDERS "")
foreach(site ${SITE_PACKAGES})
    list(APPEND PLATFORM_FOLDERS "${site}/OpenMM.libs/lib/plugins")
    foreach(package cuda_runtime cuda_nvcc cu13)
        list(APPEND CUDA_FOLDERS "${site}/nvidia/${package}/include")
    endforeach()
endforeach()
find_library(OPENMM_OPENCL OpenMMOpenCL HINTS ${PLATFORM_FOLDERS} NO_DEFAULT_PATH)
find_path(OPENCL_HEADERS CL/cl.h)
find_library(OPENMM_CUDA OpenMMCUDA HINTS ${PLATFORM_FOLDERS} NO_DEFAULT_PATH)
find_path(CUDA_HEADERS cuda.h HINTS ${CUDA_FOLDERS} PATHS /usr/local/cuda/include)
find_path(CUDA_COMPILER_HEADERS crt/host_defines.h HINTS ${CUDA_FOLDERS} PATHS /usr/local/cuda/include)
find_library(OPENMM_HIP OpenMMHIP HINTS ${PLATFORM_FOLDERS} NO_DEFAULT_PATH)
find_path(HIP_HEADERS hip/hip_runtime.h PATHS /opt/rocm/include)

if(NOT OPENMM_OPENCL)
    report_platform(OpenCL "not built, because OpenMM has no library for it")
elseif(NOT OPENMM_COMMON_HEADERS)
    report_platform(OpenCL "not built, because OpenMM has no headers for it")
elseif(NOT OPENCL_HEADERS)
    report_platform(OpenCL "not built, because CL/cl.h is missing; Debian and Ubuntu have it in opencl-c-headers")
else()
    add_gpu_plugin(OpenCL opencl "${OPENMM_OPENCL}" "${OPENCL_HEADERS}")
    target_compile_definitions(OpenMMCylinderChainOpenCL PRIVATE CL_TARGET_OPENCL_VERSION=300)
    report_platform(OpenCL "built")
endif()
if(NOT OPENMM_CUDA)
    report_platform(CUDA "not built, because OpenMM's package for CUDA was not there: install \
with OPENMM_CYLCHAIN_CUDA=12 pip install '.[cuda12]', or 13 and cuda13")
elseif(NOT OPENMM_COMMON_HEADERS)
    report_platform(CUDA "not built, because OpenMM has no headers for it")
elseif(NOT CUDA_HEADERS OR NOT CUDA_COMPILER_HEADERS)
    report_platform(CUDA "not built, because cuda.h and crt/host_defines.h are missing; nvidia-cuda-runtime-cu12 and \
nvidia-cuda-nvcc-cu12 of the package index have them")
else()
    add_gpu_plugin(CUDA cuda "${OPENMM_CUDA}" "${CUDA_HEADERS}" "${CUDA_COMPILER_HEADERS}")
    report_platform(CUDA "built")
endif()
if(NOT OPENMM_HIP)
    report_platform(HIP "not built, because OpenMM's package for HIP was not there: install \
with OPENMM_CYLCHAIN_HIP=6 pip install '.[hip6]'")
elseif(NOT OPENMM_COMMON_HEADERS)
    report_platform(HIP "not built, because OpenMM has no headers for it")
elseif(NOT HIP_HEADERS)
    report_platform(HIP "not built, because hip/hip_runtime.h is missing; ROCm has it, and Debian and Ubuntu in libamdhip64-dev")
else()
    add_gpu_plugin(HIP hip "${OPENMM_HIP}" "${HIP_HEADERS}")
    target_compile_definitions(OpenMMCylinderChainHIP PRIVATE __HIP_PLATFORM_AMD__)
    report_platform(HIP "built")
endif()
add_custom_target(gpu_plugins DEPENDS ${GPU_PLUGINS})
file(CONFIGURE OUTPUT platforms.txt @ONLY CONTENT "${PLATFORMS_TEXT}")
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/platforms.txt" DESTINATION ${PACKAGE}/lib)
