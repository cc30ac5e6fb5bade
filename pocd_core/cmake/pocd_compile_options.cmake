# Warnings, and the floating-point rules that make results the same on every CPU: no fused
# multiply-add contraction and no fast-math, so a kernel gives the same bits in each of its
# runtime-dispatched versions (POCD_KERNEL in pocd/common/kernel.hpp).
option(POCD_WERROR "Treat warnings as errors (continuous integration)" OFF)
function(pocd_compile_options target)
  set(optimisation -O3)
  if(CMAKE_CXX_FLAGS MATCHES "-fsanitize")
    set(optimisation -O1)  # what is looked for is in the source, and the build takes half the time
  endif()
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wconversion -Wno-sign-conversion
    ${optimisation} -ffp-contract=off $<$<BOOL:${POCD_WERROR}>:-Werror>)
  if(CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
    target_compile_options(${target} PRIVATE -march=x86-64-v2)
  endif()
endfunction()
