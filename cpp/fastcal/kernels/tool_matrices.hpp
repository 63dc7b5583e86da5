// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Columns of numbers of the tool as the rows' matrices. Compiled once an instruction set.
#pragma once

#include <cstdint>

#include "fastcal/kernels/lanes.hpp"
#include "fastcal/kernels/streams.hpp"
#include "fastcal/kernels/tool_columns.hpp"

namespace fastcal::kernels {

/// The numbers of a row of a matrix (Numbers, count) one after another, from columns (count, Numbers, W).
template <int W, int Numbers>
class RowWalk {
 public:
  FASTCAL_INLINE RowWalk(const double* columns, int count) : number_(columns), from_(columns), count_(count) {}

  FASTCAL_INLINE void skip(int some) {
    for (int k = 0; k < some; ++k) next();
  }

  FASTCAL_INLINE const double* next() {
    const double* here = from_;
    from_ += kApart;
    if (++column_ == count_) {
      column_ = 0;
      from_ = number_ += W;
    }
    return here;
  }

  FASTCAL_INLINE void next_four(const double* (&out)[4]) {
    if (column_ + 4 >= count_) {
      for (const double*& here : out) here = next();
      return;
    }
    for (int c = 0; c < 4; ++c) out[c] = from_ + c * kApart;
    from_ += 4 * kApart;
    column_ += 4;
  }

 private:
  static constexpr int kApart = Numbers * W;  // of two columns
  const double *number_, *from_;
  int count_, column_ = 0;
};

/// Columns (count, Numbers, W) as matrices (rows, Numbers, count) in C order, four numbers of four rows at a time. The
/// first four may overlap those behind them, so that these lie where lanes do; the last go one by one.
template <int W, int Numbers>
FASTCAL_INLINE void matrices_from(const double* columns, int count, int rows, double* matrices) {
  const int width = Numbers * count;
  for (int row = 0; row < rows; row += 4) {
    double* to = matrices + static_cast<long>(row) * width;
    const int some = rows - row < 4 ? rows - row : 4;
    const double* from[4];
    const auto write_four = [&](int k, int four) {
      Vectors<4>::Lane lanes[4];
      load_rows(lanes, from);
      for (int l = 0; l < 4 && l < four; ++l) store(to + l * static_cast<long>(width) + k, lanes[l]);
    };
    const int lead = static_cast<int>(-(reinterpret_cast<std::uintptr_t>(to) / sizeof(double)) % 4);
    RowWalk<W, Numbers> walk(columns + row, count);
    int k = 0;
    if (lead > 0 && width >= 4) {
      RowWalk<W, Numbers> first = walk;
      first.next_four(from);
      write_four(0, some);
      walk.skip(k = lead);
    }
    for (; some == 4 && k + 4 <= width; k += 4) {
      walk.next_four(from);
      write_four(k, 4);
    }
    for (; k < width; ++k) {
      const double* here = walk.next();
      for (int l = 0; l < some; ++l) to[l * static_cast<long>(width) + k] = here[l];
    }
  }
}

/// W rows at a time, so that their columns and matrices stay in the first cache.
template <int W, int Numbers>
FASTCAL_INLINE void matrices_of_tool(const double* poses, int frame_count, const FrameTwists* twists, int twist_count,
                                     int columns, int first, int rows, double* block, LineStream& out) {
  for (int part = 0; part < rows; part += W) {
    tool_columns<W, Numbers, false>(poses + part, frame_count, twists, twist_count, first + part, nullptr, W, block,
                                    Numbers * W);
    const int some = rows - part < W ? rows - part : W;
    matrices_from<W, Numbers>(block, columns, some, out.room());
    out.write(static_cast<long>(some) * Numbers * columns);
  }
}

}  // namespace fastcal::kernels
