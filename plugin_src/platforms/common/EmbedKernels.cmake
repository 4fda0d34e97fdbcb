# Writes the sources of kernels into a C++ file, as one string for each: cmake -DOUTPUT=... -DKERNELS="a.cc;b.cc" -P ...
set(text "// Made by EmbedKernels.cmake.\n#include \"CommonCylinderChainKernelSources.h\"\n\n")
foreach(kernel ${KERNELS})
    get_filename_component(name "${kernel}" NAME_WE)
    file(READ "${kernel}" source)
    # Compilers need not take strings longer than 65536 characters.
    string(APPEND text "const char* const OpenMM::CommonCylinderChainKernelSources::${name} = R\"SOURCE(${source})SOURCE\";\n\n")
endforeach()
file(WRITE "${OUTPUT}" "${text}")
