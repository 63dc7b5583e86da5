// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/kernels/instruction_sets.hpp"

#include <cstdlib>
#include <cstring>

#if defined(__x86_64__)
#include <cpuid.h>
#endif

namespace fastcal::kernels {
namespace {

// By CPUID and XGETBV (Intel's manual, volume 1, sections 14.3, 14.7.1 and 15.2), since __builtin_cpu_supports needs a
// runtime that clang-cl does not link, and which says no to everything where zig brings it.
InstructionSet widest() {
#if defined(__x86_64__)
  constexpr unsigned kFma = 1U << 12U;
  constexpr unsigned kSystemSavesVectors = 1U << 27U;
  constexpr unsigned kAvx2 = 1U << 5U;
  constexpr unsigned kAvx512 = 1U << 16U | 1U << 17U | 1U << 31U;  // F, DQ, VL
  constexpr unsigned kSaved256 = 0x06;                             // of XCR0: xmm and upper halves of ymm
  constexpr unsigned kSaved512 = 0xE6;                             // and masks, upper halves of zmm, zmm16 to zmm31
  unsigned eax = 0;
  unsigned ebx = 0;
  unsigned ecx = 0;
  unsigned edx = 0;
  if (__get_cpuid(1, &eax, &ebx, &ecx, &edx) == 0) return InstructionSet::kBaseline;
  if ((ecx & kFma) == 0 || (ecx & kSystemSavesVectors) == 0) return InstructionSet::kBaseline;
  unsigned saved = 0;
  __asm__("xgetbv" : "=a"(saved), "=d"(edx) : "c"(0));  // NOLINT(hicpp-no-assembler): an intrinsic needs -mxsave
  if (__get_cpuid_count(7, 0, &eax, &ebx, &ecx, &edx) == 0) return InstructionSet::kBaseline;
  if ((ebx & kAvx512) == kAvx512 && (saved & kSaved512) == kSaved512) return InstructionSet::kAvx512;
  if ((ebx & kAvx2) != 0 && (saved & kSaved256) == kSaved256) return InstructionSet::kAvx2;
#endif
  return InstructionSet::kBaseline;
}

InstructionSet chosen() {
  const char* wanted = std::getenv("FASTCAL_ISA");
  if (wanted == nullptr || *wanted == '\0') return widest();
  constexpr InstructionSet kSets[] = {InstructionSet::kBaseline, InstructionSet::kAvx2, InstructionSet::kAvx512};
  for (const InstructionSet set : kSets) {
    const bool named = std::strcmp(wanted, name_of(set)) == 0 ||
                       (set == InstructionSet::kBaseline && std::strcmp(wanted, "baseline") == 0);
    if (named && set <= widest()) return set;
  }
  return InstructionSet::kUnavailable;
}

}  // namespace

InstructionSet instruction_set() {
  static const InstructionSet set = chosen();
  return set;
}

const char* name_of(InstructionSet set) {
  switch (set) {
    case InstructionSet::kBaseline:
#if defined(__aarch64__)
      return "neon";
#else
      return "baseline";
#endif
    case InstructionSet::kAvx2:
      return "avx2";
    case InstructionSet::kAvx512:
      return "avx512";
    case InstructionSet::kUnavailable:
      break;
  }
  return "";
}

}  // namespace fastcal::kernels
