#include "compiler/base/temporary_files.h"

#include <unistd.h>

#include <array>
#include <atomic>
#include <climits>
#include <csignal>
#include <cstring>
#include <initializer_list>
#include <utility>

namespace morphbus {
namespace {

/// One path that a signal removes. Memory of its own, since a handler may touch no other.
struct Slot {
  /// Whether a TemporaryPath has it, and whether its text is whole.
  std::atomic<bool> taken = false, ready = false;
  std::array<char, PATH_MAX> path = {};
};
/// More than a command ever has at a time; what finds no place is removed by its destructor alone.
std::array<Slot, 32> g_slots;

void RemoveAndEnd(int signal) {
  // Folders are empty only after the files in them are gone.
  for (const bool folders : {false, true}) {
    for (const Slot& slot : g_slots) {
      // Both calls are async-signal-safe (POSIX), and fail where nothing is left to remove.
      if (slot.ready) folders ? rmdir(slot.path.data()) : unlink(slot.path.data());
    }
  }
  // The status says which signal it was, as if it had not been caught.
  std::signal(signal, SIG_DFL);
  raise(signal);
}

}  // namespace

void RemoveTemporariesOnSignal() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    // The first call only asks what is set: an ignored signal stays ignored.
    struct sigaction action = {};
    if (sigaction(signal, nullptr, &action) != 0 || action.sa_handler == SIG_IGN) continue;
    action = {};
    action.sa_handler = RemoveAndEnd;
    sigaction(signal, &action, nullptr);
  }
}

SignalsBlocked::SignalsBlocked() {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, &before_);
}

SignalsBlocked::~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

TemporaryPath::TemporaryPath(std::string path) : path_(std::move(path)) {
  // A longer path cannot be opened by the system's calls either; its object only removes by the
  // destructor.
  if (path_.size() >= PATH_MAX) return;
  for (size_t i = 0; i < g_slots.size() && slot_ < 0; ++i) {
    // Whether a slot is free is decided by one atomic exchange, so that no two threads take the
    // same; the handler looks at it only once its text is whole.
    if (g_slots[i].taken.exchange(true)) continue;
    slot_ = static_cast<int>(i);
    std::memcpy(g_slots[i].path.data(), path_.c_str(), path_.size() + 1);
    g_slots[i].ready = true;
  }
}

TemporaryPath::~TemporaryPath() {
  if (path_.empty()) return;
  // A path that was never made fails in both, which does no harm.
  if (unlink(path_.c_str()) != 0) rmdir(path_.c_str());
  Keep();
}

void TemporaryPath::Keep() {
  path_.clear();
  if (slot_ < 0) return;
  // In this order: between the two the slot is taken and not looked at by the handler.
  g_slots[slot_].ready = false;
  g_slots[slot_].taken = false;
  slot_ = -1;
}

}  // namespace morphbus
