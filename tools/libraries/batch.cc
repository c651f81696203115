#include <morphbus/run/batch.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <system_error>
#include <thread>
#include <utility>

namespace morphbus {
namespace {

/// Calls `work` once for each number below `count`, on this thread and so many less one. What is
/// thrown first, by the order of the numbers, goes on to the caller when all is done.
template <class Work>
void ForEach(size_t count, int threads, const Work& work) {
  std::vector<std::exception_ptr> thrown(count);
  std::atomic<size_t> next = 0;
  const auto take = [&] {
    for (size_t i = next++; i < count; i = next++) {
      try {
        work(i);
      } catch (...) {
        thrown[i] = std::current_exception();
      }
    }
  };
  {
    std::vector<std::jthread> others;
    const size_t most = std::min(count, static_cast<size_t>(threads));
    try {
      for (size_t t = 1; t < most; ++t) others.emplace_back(take);
    } catch (const std::system_error&) {
      // Fewer threads than were asked for do the same.
    }
    take();
  }
  for (const std::exception_ptr& one : thrown) {
    if (one) std::rethrow_exception(one);
  }
}

}  // namespace

Batch::Batch(std::vector<Run*> runs, int threads) : runs_(std::move(runs)), threads_(threads) {
  if (threads < 0) throw Failure("threads: expected a number, or 0 for one a processor");
  for (size_t i = 0; i < runs_.size(); ++i) {
    if (runs_[i] == nullptr) throw Failure("a run of the batch is none");
    if (std::find(runs_.begin(), runs_.begin() + static_cast<std::ptrdiff_t>(i), runs_[i]) !=
        runs_.begin() + static_cast<std::ptrdiff_t>(i)) {
      throw Failure("a run is in the batch twice");
    }
  }
  if (threads == 0) threads_ = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void Batch::Step(int64_t ticks) {
  ForEach(runs_.size(), threads_, [&](size_t i) {
    if (!runs_[i]->over()) runs_[i]->Step(ticks);
  });
}

bool Batch::over() const {
  return std::ranges::all_of(runs_, [](const Run* run) { return run->over(); });
}

std::vector<RunResult> Batch::Close() {
  ForEach(runs_.size(), threads_, [&](size_t i) { runs_[i]->Close(); });
  std::vector<RunResult> results;
  for (Run* run : runs_) results.push_back(run->Close());
  return results;
}

}  // namespace morphbus
