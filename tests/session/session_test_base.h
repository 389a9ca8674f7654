#pragma once

#include <gtest/gtest.h>

#include <condition_variable>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "palpate/session/session.h"

namespace palpate::test {

/// A session that is asked, and waited for, in one thread.
class SessionTest : public testing::Test {
 protected:
  void begin(const std::filesystem::path& root, bool may_open_live = false) {
    session_ = std::make_unique<Session>(
        RootFolder(root),
        [this] {
          const std::lock_guard lock(mutex_);
          changed_.notify_all();
        },
        may_open_live);
  }

  /// Before the folder that it works in goes.
  void TearDown() override { session_.reset(); }

  /// What came of a command: empty = it was obeyed.
  std::string ask(Command command) {
    std::promise<std::string> told;
    session_->ask(std::move(command), [&told](const std::string& sentence) { told.set_value(sentence); });
    return told.get_future().get();
  }

  template <class Condition>
  SharedSnapshot wait_for(const Condition& condition) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return condition(*session_->newest()); });
    return session_->newest();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;

 protected:
  std::unique_ptr<Session> session_;
};

}  // namespace palpate::test
