# A library of files that include one header each, twice, and nothing else: to see that headers compile alone. Those whose
# names end in -inl.h are parts of other files and are left out.
function(add_headers_alone target library)
    list(FILTER ARGN EXCLUDE REGEX "-inl\\.h$")
    foreach(header ${ARGN})
        string(MAKE_C_IDENTIFIER "${header}" name)
        set(source "${CMAKE_CURRENT_BINARY_DIR}/${target}/${name}.cpp")
        file(CONFIGURE OUTPUT "${source}" CONTENT "#include \"${header}\"\n#include \"${header}\"\n")
        list(APPEND sources "${source}")
    endforeach()
    add_library(${target} OBJECT ${sources})
    target_link_libraries(${target} PRIVATE ${library})
    target_compile_options(${target} PRIVATE ${CYLCHAIN_WARNING_OPTIONS})
endfunction()
