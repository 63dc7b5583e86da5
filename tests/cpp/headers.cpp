// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Empty: a precompiled header belongs to a target, and a target needs a source.
