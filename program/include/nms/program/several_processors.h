#pragma once

/// Before a function whose loop is compiled for several processors; the widest that this one has is chosen as the
/// program is loaded. Each does the same operations in the same order, so each gives the same bits.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__) && defined(__GLIBC__) && \
    !defined(__SANITIZE_ADDRESS__)
#define NMS_FOR_SEVERAL_PROCESSORS __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define NMS_FOR_SEVERAL_PROCESSORS
#endif
