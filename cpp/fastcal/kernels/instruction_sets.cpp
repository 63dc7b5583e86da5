// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/kernels/instruction_sets.hpp"

#include <cstdlib>
#include <cstring>

namespace fastcal::kernels {
namespace {

InstructionSet widest() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
    return InstructionSet::kAvx512;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return InstructionSet::kAvx2;
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
