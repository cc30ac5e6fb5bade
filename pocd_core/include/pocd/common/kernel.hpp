// Runtime dispatch for inner loops: the compiler makes a plain, an AVX2 and an AVX-512 version of a
// function marked POCD_KERNEL and the loader picks one. With -ffp-contract=off all give the same bits.
// Not with sanitizers: the loader would pick, by code of the program, before their runtime is there.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define POCD_KERNEL __attribute__((target_clones("default", "avx2", "arch=x86-64-v4")))
#else
#define POCD_KERNEL
#endif
