#pragma once
// Runs beside each other, on several processors: robots, programs and options may all differ.
//
// Library morphbus-run. A batch belongs to one thread at a time; its own threads come and go with
// each call. What happens in a run does not depend on their number.

#include <morphbus/run/run.h>

#include <cstdint>
#include <vector>

namespace morphbus {

/// Runs that go on together.
class MORPHBUS_EXPORT Batch {
 public:
  /// @param runs     outlive the batch; none of them twice.
  /// @param threads  how many runs go on at once; 0: as many as there are processors.
  explicit Batch(std::vector<Run*> runs, int threads = 0);

  [[nodiscard]] size_t size() const { return runs_.size(); }

  /// Steps every run that is not over (Run::Step). Throws Failure, when all have gone on, with what
  /// the first of them has thrown.
  void Step(int64_t ticks = 1);
  /// True once every run is over.
  [[nodiscard]] bool over() const;
  /// Closes every run, and tells how they went, in their order.
  std::vector<RunResult> Close();

 private:
  std::vector<Run*> runs_;
  int threads_;
};

}  // namespace morphbus
