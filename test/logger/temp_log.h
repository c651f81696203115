#pragma once
// A log file that is gone when the test is over.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <string>

#include "test/support/synthetic_log.h"

namespace morphbus::logger {

class TempFile {
 public:
  explicit TempFile(const std::string& name = "x.log") {
    static int count = 0;
    path_ = ::testing::TempDir() + "morphbus_" + std::to_string(getpid()) + "_" +
            std::to_string(++count) + "_" + name;
  }
  ~TempFile() {
    std::remove(path_.c_str());
    std::remove((path_ + ".partial").c_str());
  }
  TempFile(const TempFile&) = delete;
  TempFile& operator=(const TempFile&) = delete;
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// A synthetic run on disk.
class TempLog : public TempFile {
 public:
  explicit TempLog(const test::SyntheticOptions& options = {}) {
    test::WriteSyntheticLog(path(), options);
  }
  explicit TempLog(const std::vector<uint8_t>& bytes) { test::WriteBytes(path(), bytes); }
};

}  // namespace morphbus::logger
