// SPDX-FileCopyrightText: 2026 The fastcal authors
// SPDX-License-Identifier: MIT
#include "fastcal/math/thread_pool.hpp"

#include <pthread.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <system_error>
#include <thread>

namespace fastcal {
namespace {

constexpr std::chrono::microseconds kWatch{100};  // for the next work, before a thread sleeps: passes follow each other

class ThreadPool {
 public:
  void run(int helpers, const std::function<void()>& body) {
    if (is_taken_.exchange(true)) return body();
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      start(helpers);
      body_ = &body;
      places_ = helpers;
      ++call_;
    }
    begun_.notify_all();
    body();
    {
      std::unique_lock<std::mutex> lock(mutex_);
      places_ = 0;
      ended_.wait(lock, [this] { return running_ == 0; });
    }
    is_taken_ = false;
  }

 private:
  /// As many threads as are asked for, or as the system lets it have.
  void start(int count) try {
    for (; thread_count_ < count; ++thread_count_) std::thread(&ThreadPool::live, this).detach();
  } catch (const std::system_error&) {
  }

  void live() {
    unsigned seen = 0;
    for (;;) {
      const auto until = std::chrono::steady_clock::now() + kWatch;
      while (call_ == seen && std::chrono::steady_clock::now() < until) std::this_thread::yield();
      std::unique_lock<std::mutex> lock(mutex_);
      begun_.wait(lock, [&] { return call_ != seen; });
      seen = call_;
      if (places_ == 0) continue;
      --places_;
      ++running_;
      const std::function<void()>& body = *body_;
      lock.unlock();
      body();
      lock.lock();
      if (--running_ == 0) ended_.notify_one();
    }
  }

  std::atomic<bool> is_taken_ = false;
  std::mutex mutex_;
  std::condition_variable begun_, ended_;
  const std::function<void()>* body_ = nullptr;
  std::atomic<unsigned> call_ = 0;
  int thread_count_ = 0, places_ = 0, running_ = 0;
};

/// Never destroyed: its threads end with the process. A fork has none of them and gets a new pool.
std::atomic<ThreadPool*>& pool() {
  static std::atomic<ThreadPool*> the_pool = [] {
    pthread_atfork(nullptr, nullptr, [] { pool() = new ThreadPool; });
    return new ThreadPool;
  }();
  return the_pool;
}

}  // namespace

void run_together(int helpers, const std::function<void()>& body) { pool().load()->run(helpers, body); }

}  // namespace fastcal
