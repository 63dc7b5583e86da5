// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
//
// Threads that live as long as the process: to start one takes as long as a pass over some ten thousand rows.
#pragma once

#include <functional>

namespace fastcal {

/// Calls body() on this thread and on up to `helpers` others at once, and returns when all that began have ended. A
/// helper that has not begun when this thread is done does not begin, so body() takes its work from a shared counter.
/// While the threads work for another caller, body() runs on this one alone. It must not throw.
void run_together(int helpers, const std::function<void()>& body);

}  // namespace fastcal
