// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// A kernel template over the lanes of a vector, compiled once an instruction set, and the one of them to run.
#pragma once

namespace fastcal::kernels {

enum class InstructionSet { kUnavailable, kBaseline, kAvx2, kAvx512 };

/// The set that the environment variable FASTCAL_ISA names (baseline, avx2, avx512; neon is the baseline of aarch64),
/// kUnavailable where it names none that this processor has; without it, the widest one. Found once.
InstructionSet instruction_set();

/// "baseline", "avx2", "avx512"; "neon" for the baseline of aarch64; "" for kUnavailable.
const char* name_of(InstructionSet set);

}  // namespace fastcal::kernels

#if defined(__x86_64__)

#define FASTCAL_AVX2 __attribute__((target("avx2,fma")))
#if defined(__clang__)  // does not know the width that GCC has to be asked for
#define FASTCAL_AVX512 __attribute__((target("avx512f,avx512dq,avx512vl,fma")))
#else
#define FASTCAL_AVX512 __attribute__((target("avx512f,avx512dq,avx512vl,fma,prefer-vector-width=512")))
#endif

// NOLINTBEGIN(bugprone-macro-parentheses): a template's name, parameters and arguments take none
/// Functions NAME_baseline, NAME_avx2 and NAME_avx512 that call KERNEL<W> with ARGUMENTS.
#define FASTCAL_FOR_EACH_SET(NAME, KERNEL, PARAMETERS, ARGUMENTS)   \
  void NAME##_baseline PARAMETERS { KERNEL<4> ARGUMENTS; }          \
  FASTCAL_AVX2 void NAME##_avx2 PARAMETERS { KERNEL<4> ARGUMENTS; } \
  FASTCAL_AVX512 void NAME##_avx512 PARAMETERS { KERNEL<8> ARGUMENTS; }
// NOLINTEND(bugprone-macro-parentheses)

#define FASTCAL_BEST_SET(NAME)                                                                          \
  (::fastcal::kernels::instruction_set() == ::fastcal::kernels::InstructionSet::kAvx512 ? NAME##_avx512 \
   : ::fastcal::kernels::instruction_set() == ::fastcal::kernels::InstructionSet::kAvx2 ? NAME##_avx2   \
                                                                                        : NAME##_baseline)

#else

#define FASTCAL_FOR_EACH_SET(NAME, KERNEL, PARAMETERS, ARGUMENTS) \
  void NAME##_baseline PARAMETERS { KERNEL<4> ARGUMENTS; }

#define FASTCAL_BEST_SET(NAME) NAME##_baseline

#endif
