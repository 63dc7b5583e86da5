// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// What least squares makes of a block of rows: its Gram matrix, or the triangle of its QR factorization. Plain arrays
// only, compiled for the instruction sets chosen from at run time. A block is stored column by column, `ld` apart; its
// rows are a multiple of kGroup.
#pragma once

namespace fastcal::kernels {

/// Adds the upper triangle of B^T B to that of `A` (columns x columns), column by column.
void add_gram(const double* block, int ld, int rows, int columns, double* A);

/// The same where all columns but `columns`, `count` of them in rising order, are zero; A (size x size).
void add_gram(const double* block, int ld, int rows, const int* columns, int count, int size, double* A);

/// Adds the squared lengths of B x for two directions x (columns) at once.
void add_squares_along(const double* block, int ld, int rows, int columns, const double* x, const double* y,
                       double out[2]);

/// Rows of each column added up in parts, `stride` of them, one beneath the other: out_i = sum_n turn_n,i B_n,i; `turn`
/// (parts, stride), `out` as far apart as the block.
void add_parts(const double* block, int ld, int stride, int parts, int columns, const double* turn, double* out);

/// R <- upper triangle of the QR factorization of [R; B] by Householder's reflections; R (columns x columns) column by
/// column. The block is lost.
void update_triangle(double* block, int ld, int rows, int columns, double* R);

}  // namespace fastcal::kernels
