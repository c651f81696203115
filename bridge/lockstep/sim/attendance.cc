#include "bridge/lockstep/sim/attendance.h"

#include <algorithm>

namespace morphbus::bridge {

Attendance::Attendance(int num_modules, bool logger) {
  const auto modules = static_cast<size_t>(num_modules);
  greeted_ = acknowledged_ = std::vector<bool>(modules + (logger ? 1 : 0));
  // Only modules answer ticks; the logger acknowledges in its own time.
  answered_ = leaving_ = gone_ = std::vector<bool>(modules);
}

bool Attendance::Note(int index, std::vector<bool>* flags) {
  // Whatever comes a second time changes no count.
  if (index < 0 || static_cast<size_t>(index) >= flags->size() || (*flags)[index]) return false;
  (*flags)[index] = true;
  return true;
}

bool Attendance::Answer(int module) {
  if (!Note(module, &answered_)) return false;
  ++num_answers_;
  return true;
}

bool Attendance::Leave(int member) {
  // The logger never leaves before the end, and a module only if it was asked to.
  const bool module = member >= 0 && static_cast<size_t>(member) < leaving_.size();
  if (!module || !leaving_[member]) return false;
  leaving_[member] = false;
  gone_[member] = acknowledged_[member] = true;
  return true;
}

void Attendance::GoOnWithout(int module) {
  // The tick that is out would else wait for an answer that never comes.
  gone_[module] = true;
  Answer(module);
}

void Attendance::BeginTick() {
  // A module that is gone counts as having answered every tick.
  answered_ = gone_;
  num_gone_ = static_cast<int>(std::ranges::count(gone_, true));
  num_answers_ = 0;
}

bool Attendance::AllGreeted() const { return std::ranges::count(greeted_, false) == 0; }
bool Attendance::AnyLeaving() const { return std::ranges::count(leaving_, true) > 0; }

bool Attendance::AllModulesAcknowledged() const {
  // The logger comes behind the modules, and acknowledges END for itself.
  const auto modules = static_cast<std::ptrdiff_t>(answered_.size());
  return std::count(acknowledged_.begin(), acknowledged_.begin() + modules, false) == 0;
}

}  // namespace morphbus::bridge
