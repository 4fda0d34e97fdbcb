# The instruction sets that loops over lanes are compiled for. Wheels have all of them; what is installed where it is
# compiled needs that of this processor alone.

option(CYLCHAIN_FOR_THIS_PROCESSOR "Compile loops for the instruction set of this processor alone" OFF)
set(CYLCHAIN_INSTRUCTION_SETS Baseline)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$")
    # In this order: where files share an inline function, the linker takes the first, which every processor can run.
    set(CYLCHAIN_INSTRUCTION_SETS Baseline Avx2 Avx512)
    add_compile_definitions(CYLCHAIN_X86_64)
    if(CYLCHAIN_FOR_THIS_PROCESSOR AND NOT CMAKE_CROSSCOMPILING)
        include(CheckCXXSourceRuns)
        check_cxx_source_runs("int main() {
            return __builtin_cpu_supports(\"avx512f\") && __builtin_cpu_supports(\"avx512dq\") &&
                __builtin_cpu_supports(\"avx512vl\") ? 0 : 1;
            }" CYLCHAIN_AVX512_IS_HERE)
        check_cxx_source_runs("int main() {
            return __builtin_cpu_supports(\"avx2\") && __builtin_cpu_supports(\"fma\") ? 0 : 1;
            }" CYLCHAIN_AVX2_IS_HERE)
        if(CYLCHAIN_AVX512_IS_HERE)
            set(CYLCHAIN_INSTRUCTION_SETS Avx512)
        elseif(CYLCHAIN_AVX2_IS_HERE)
            set(CYLCHAIN_INSTRUCTION_SETS Avx2)
        endif()
    endif()
endif()
list(JOIN CYLCHAIN_INSTRUCTION_SETS ", " listed)
message(STATUS "Instruction sets: ${listed}")

set(CYLCHAIN_OPTIONS_FOR_Avx512 -mavx512f -mavx512dq -mfma)
set(CYLCHAIN_OPTIONS_FOR_Avx2 -mavx2 -mfma)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$")
    # Only processors from before 2013 run these, which take half the time to compile so. They compute the same, for
    # they have no fused operations.
    set(CYLCHAIN_OPTIONS_FOR_Baseline -O1)
    if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
        list(APPEND CYLCHAIN_OPTIONS_FOR_Baseline -Wno-maybe-uninitialized)
    endif()
endif()

# For lanes/InstructionSet.h: in a file, so that with other instruction sets only what asks for them is compiled again.
set(definitions "")
foreach(set Baseline Avx2 Avx512)
    string(TOUPPER "${set}" name)
    if(set IN_LIST CYLCHAIN_INSTRUCTION_SETS)
        string(APPEND definitions "#define CYLCHAIN_HAS_${name} true\n")
    else()
        string(APPEND definitions "#define CYLCHAIN_HAS_${name} false\n")
    endif()
endforeach()
file(CONFIGURE OUTPUT "${CMAKE_BINARY_DIR}/generated/lanes/CompiledInstructionSets.h" CONTENT "${definitions}" @ONLY)
include_directories("${CMAKE_BINARY_DIR}/generated")

# Add files to a target, of each pattern one for each instruction set, whose name is where the pattern has an @. What
# follows OPTIONS are options for all of them.
function(add_for_instruction_sets target)
    cmake_parse_arguments(PARSE_ARGV 1 given "" "" "OPTIONS")
    foreach(pattern ${given_UNPARSED_ARGUMENTS})
        foreach(set ${CYLCHAIN_INSTRUCTION_SETS})
            string(REPLACE @ "${set}" source "${pattern}")
            target_sources(${target} PRIVATE "${source}")
            set(options ${CYLCHAIN_OPTIONS_FOR_${set}} ${given_OPTIONS})
            set_source_files_properties("${source}" PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON
                COMPILE_OPTIONS "${options}")
        endforeach()
    endforeach()
endfunction()
