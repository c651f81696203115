#pragma once
// Files that must not outlive an interrupted command: what is written under a temporary name until
// it is whole.

#include <csignal>
#include <string>

namespace morphbus {

/// Makes SIGINT, SIGTERM and SIGHUP remove what TemporaryPath objects name before they end the
/// process as they would by themselves; first thing in main. A signal that the parent had ignored
/// stays ignored, as in a shell's background job. Commands that end in an order of their own take
/// the signals over.
void RemoveTemporariesOnSignal();

/// A file or an empty folder that a signal removes, for as long as this object lives or until
/// Keep(). The destructor removes it, too: an error and a signal leave the same behind.
class TemporaryPath {
 public:
  /// Of a file that is there, or that is made next.
  explicit TemporaryPath(std::string path);
  TemporaryPath(const TemporaryPath&) = delete;
  TemporaryPath& operator=(const TemporaryPath&) = delete;
  ~TemporaryPath();

  /// From now on neither a signal nor the destructor removes the path: it has been renamed, or
  /// shall stay.
  void Keep();
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
  /// Its place among those that the signals remove; -1: none (any more).
  int slot_ = -1;
};

/// While it lives, this thread takes no signal: none comes between making a file and the
/// TemporaryPath by which a signal would remove it.
class SignalsBlocked {
 public:
  SignalsBlocked();
  SignalsBlocked(const SignalsBlocked&) = delete;
  SignalsBlocked& operator=(const SignalsBlocked&) = delete;
  ~SignalsBlocked();

 private:
  sigset_t before_ = {};
};

}  // namespace morphbus
