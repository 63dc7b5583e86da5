// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A kernel template over the lanes of a vector, compiled once an instruction set, and the best of them at run time.
#pragma once

#if defined(__x86_64__)

/// Functions NAME_baseline, NAME_avx2 and NAME_avx512 that call KERNEL<W> with ARGUMENTS.
#define FASTCAL_FOR_EACH_SET(NAME, KERNEL, PARAMETERS, ARGUMENTS)                                                  \
  void NAME##_baseline PARAMETERS { KERNEL<4> ARGUMENTS; }                                                         \
  __attribute__((target("avx2,fma"))) void NAME##_avx2 PARAMETERS { KERNEL<4> ARGUMENTS; }                         \
  __attribute__((target("avx512f,avx512dq,avx512vl,fma,prefer-vector-width=512"))) void NAME##_avx512 PARAMETERS { \
    KERNEL<8> ARGUMENTS;                                                                                           \
  }

#define FASTCAL_BEST_SET(NAME)                                                                                   \
  (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") \
       ? NAME##_avx512                                                                                           \
   : __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? NAME##_avx2                               \
                                                                     : NAME##_baseline)

#else

#define FASTCAL_FOR_EACH_SET(NAME, KERNEL, PARAMETERS, ARGUMENTS) \
  void NAME##_baseline PARAMETERS { KERNEL<4> ARGUMENTS; }

#define FASTCAL_BEST_SET(NAME) NAME##_baseline

#endif
