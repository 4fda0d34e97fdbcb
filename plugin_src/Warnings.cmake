# Warnings are for those who change the code: to look for them takes a tenth of the time of compiling.

set(with_warnings ON)
if(SKBUILD AND NOT CMAKE_COMPILE_WARNING_AS_ERROR)
    set(with_warnings OFF)
endif()
option(CYLCHAIN_WARNINGS "Warn of what may be a mistake" ${with_warnings})
if(CYLCHAIN_WARNINGS)
    set(CYLCHAIN_WARNING_OPTIONS -Wall -Wextra -Werror=switch -Wno-psabi)
else()
    set(CYLCHAIN_WARNING_OPTIONS -w)
endif()
