#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace palpate {

/// The newest value from one thread to one other. Neither ever waits or tries again (triple buffer).
template <class T>
class HandOver {
 public:
  void write(const T& value) {
    slots_[back_] = value;
    back_ = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel) & ~kFresh;
  }

  /// The newest value; `fresh`: it is another one than last time.
  const T& read(bool* fresh = nullptr) {
    const bool is_fresh = middle_.load(std::memory_order_relaxed) & kFresh;
    if (is_fresh) front_ = middle_.exchange(front_, std::memory_order_acq_rel) & ~kFresh;
    if (fresh) *fresh = is_fresh;
    return slots_[front_];
  }

 private:
  static constexpr unsigned kFresh = 4;
  std::array<T, 3> slots_{};
  unsigned back_ = 0, front_ = 1;
  std::atomic<unsigned> middle_{2};
};

/// The newest value from one thread to any number of others. The writer never waits; a reader that meets it at work
/// tries again (Boehm 2012, "Can seqlocks get along with programming language memory models?").
template <class T>
class Broadcast {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  Broadcast() { write(T{}); }

  void write(const T& value) {
    std::array<uint64_t, kWords> words{};
    std::memcpy(words.data(), &value, sizeof(T));
    const unsigned before = sequence_.load(std::memory_order_relaxed);
    sequence_.store(before + 1, std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_release);
    for (size_t i = 0; i < kWords; ++i) words_[i].store(words[i], std::memory_order_relaxed);
    sequence_.store(before + 2, std::memory_order_release);
  }

  T read() const {
    std::array<uint64_t, kWords> words{};
    unsigned before, after;
    do {
      before = sequence_.load(std::memory_order_acquire);
      for (size_t i = 0; i < kWords; ++i) words[i] = words_[i].load(std::memory_order_relaxed);
      std::atomic_thread_fence(std::memory_order_acquire);
      after = sequence_.load(std::memory_order_relaxed);
    } while (before != after || before % 2 != 0);
    T value;
    std::memcpy(static_cast<void*>(&value), words.data(), sizeof(T));
    return value;
  }

 private:
  static constexpr size_t kWords = (sizeof(T) + 7) / 8;
  std::array<std::atomic<uint64_t>, kWords> words_{};
  std::atomic<unsigned> sequence_{0};
};

}  // namespace palpate
