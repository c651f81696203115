#pragma once
// Which members of a run have done what the simulator waits for.

#include <string>
#include <vector>

namespace morphbus::bridge {

/// Who has joined, has answered the tick that is out, has acknowledged END, and who is to leave or
/// has left. Members go by number: the modules, then the logger, if there is one. Numbers that are
/// not of the run change nothing.
class Attendance {
 public:
  Attendance(int num_modules, bool logger);

  // What a member does. False if it has done so before.
  /// It joins.
  bool Greet(int member) { return Note(member, &greeted_); }
  /// A module answers the tick that is out.
  bool Answer(int module);
  /// It acknowledges END.
  bool Acknowledge(int member) { return Note(member, &acknowledged_); }
  /// A module that was asked to leave has left, which also acknowledges END. False if it was not
  /// asked to.
  bool Leave(int member);

  /// A module is to leave, once it has answered the tick that is out.
  void AskToLeave(int module) { leaving_[module] = true; }
  /// The run goes on without a module as of now, whatever it still does.
  void GoOnWithout(int module);
  /// The next tick begins unanswered; of modules that are gone no answer is awaited.
  void BeginTick();

  /// How many members there are.
  [[nodiscard]] int size() const { return static_cast<int>(greeted_.size()); }
  [[nodiscard]] bool greeted(int member) const { return greeted_[member]; }
  [[nodiscard]] bool acknowledged(int member) const { return acknowledged_[member]; }
  /// Whether a module has answered the tick that is out.
  [[nodiscard]] bool answered(int module) const { return answered_[module]; }
  /// Whether a module is to leave.
  [[nodiscard]] bool leaving(int module) const { return leaving_[module]; }
  /// A module has left: nothing that it may still say counts.
  [[nodiscard]] bool gone(int module) const { return gone_[module]; }
  /// The run goes on without this module, or will from the next tick on.
  [[nodiscard]] bool lost(int module) const { return gone_[module] || leaving_[module]; }

  [[nodiscard]] bool AllGreeted() const;
  [[nodiscard]] bool AllAnswered() const { return num_missing() == 0; }
  [[nodiscard]] bool AllModulesAcknowledged() const;
  [[nodiscard]] bool AnyLeaving() const;
  /// Answers that the present tick has, and that it still lacks.
  [[nodiscard]] int num_answers() const { return num_answers_; }
  [[nodiscard]] int num_missing() const {
    return static_cast<int>(answered_.size()) - num_gone_ - num_answers_;
  }

 private:
  friend struct MachineState;  ///< As in SimLockstep.

  /// Sets a flag; false if it was set, or there is none.
  static bool Note(int index, std::vector<bool>* flags);

  std::vector<bool> greeted_, acknowledged_;     ///< By member.
  std::vector<bool> answered_, leaving_, gone_;  ///< By module.
  int num_gone_ = 0;                             ///< When the present tick began.
  int num_answers_ = 0;
};

}  // namespace morphbus::bridge
