#pragma once
// What has come of a module with a clock of its own (test/micro/clock_main.cc), for the test.

#include <stdio.h>

#include <initializer_list>

#include "test/micro/servo.h"
#include "vm/port/firmware.h"

namespace morphbus::test {

class Story {
 public:
  /// Before the first tick, with the program that the module is started with.
  explicit Story(const vm::VerifiedProgram& first) : first_(first) {}

  /// Takes note of a tick, which followed the tick `before`.
  void Note(const vm::Firmware& firmware, int64_t before) {
    if (firmware.tick() > before + 1) ++leaps_;
    // A few frames in a row may get lost.
    const bool near = firmware.lag() <= 3 && firmware.lag() >= -20;
    together_ = near ? together_ + 1 : 0;
    const vm::StatusReport& status = firmware.output().status;
    in_role_ = status.role >= 0 ? in_role_ + 1 : 0;
    faults_ += status.num_faults;
    int64_t root_tick = 0;
    if (switch_tick_ < 0 && firmware.program().bytes() != first_.bytes() &&
        firmware.RootTick(&root_tick)) {
      switch_tick_ = root_tick;
      in_role_ = 0;
    }
  }
  /// The clocks of both have been near each other for a while, and the role has been held.
  [[nodiscard]] bool HasSettled() const { return together_ >= 100 && in_role_ >= 75; }
  /// And all that under the program that came later.
  [[nodiscard]] bool IsOver() const { return switch_tick_ >= 0 && HasSettled(); }

  void Tell(const vm::Firmware& firmware, const Servo* servos,
            const vm::PackageStore& packages) const {
    const bool in_flash = firmware.program().bytes() == packages.Read(0) + vm::kPackageHeadBytes;
    printf("switched %ld role %d leaps %d faults %d in_flash %d\n", static_cast<long>(switch_tick_),
           firmware.output().status.role, leaps_, faults_, in_flash);
    for (const int j : {0, 1}) {
      const Servo& servo = servos[j];
      printf("joint%d %d lowest%d %d highest%d %d\n", j, static_cast<int>(1000 * servo.position), j,
             static_cast<int>(1000 * servo.lowest), j, static_cast<int>(1000 * servo.highest));
    }
  }

 private:
  const vm::VerifiedProgram& first_;
  int leaps_ = 0;     ///< Ticks that did not follow the one before.
  int together_ = 0;  ///< Ticks for which both clocks have been near each other,
  int in_role_ = 0;   ///< and for which a role has been held under the program that runs.
  int faults_ = 0;
  int64_t switch_tick_ = -1;  ///< The root's, when the later program began here.
};

}  // namespace morphbus::test
