#pragma once
// A module that exists only on paper, for running programs without a robot: it answers questions
// about its structure from a fixed table and writes down everything it is told to do.

#include <string>
#include <vector>

#include "compiler/keywords/keyword_table.h"
#include "vm/run/interpreter.h"

namespace morphbus::dynarole {

/// Keywords of M-TRAN (type 0) and of a type "SLIDER" (type 1), whose joints of the same names
/// slide.
keywords::KeywordTable TestKeywords();

/// Neighbours on connectors 0 (north), 1 (south), 2 (south and east); the one on 0 plays the role
/// named "Other". Joint 0 lies east-west with 1 adjacent joint, joint 1 up-down with 2. The bodies
/// of links 0, 1, 2 have degrees 1, 2, 2. Keywords are those of M-TRAN. Something is
/// docked to connector 0, whose EXTENDED is true. The root's time is 2.5 s, the root 3 dockings
/// away, and every random number a quarter. A distance is 100 mm towards the north and 2000 mm
/// elsewhere, something touches in the south, and the tilt is 12 degrees about every axis.
class FakeHost final : public vm::ProgramHost {
 public:
  explicit FakeHost(const vm::VerifiedProgram& program) : program_(program) {}

  std::vector<std::string> log;
  vm::OpResult next_result;  ///< What operations with an effect answer, besides waiting.

  uint32_t Connected(vm::Direction d) override;
  uint32_t ConnectedRole(vm::Direction d, int role) override;
  int CountModules(uint32_t connector_mask) override;
  uint32_t Joints(vm::Axis axis, int adjacent) override;
  uint32_t Links(int degree) override;
  vm::Axis JointAxis(int joint) override;
  vm::Axis CenterAxis() override;
  int Keyword(int keyword) override;
  vm::OpResult SetJointAxis(int joint, int link, vm::Axis axis) override;
  vm::OpResult RotateDegrees(int joint, float degrees, bool blocking) override;
  vm::OpResult SetDegrees(int joint, float degrees, bool blocking) override;
  vm::OpResult JointDegrees(int joint, float* degrees) override;
  vm::OpResult JointEffort(int joint, float* effort) override;
  vm::OpResult JointVelocity(int joint, float* velocity) override;
  vm::OpResult TurnContinuous(int joint, float degrees_per_s) override;
  vm::OpResult MoveMillimetres(int joint, float mm, bool blocking) override;
  vm::OpResult SetMillimetres(int joint, float mm, bool blocking) override;
  vm::OpResult JointMillimetres(int joint, float* mm) override;
  vm::OpResult SetPosition(int joint, float degrees) override;
  vm::OpResult GetPosition(int joint, float* degrees) override;
  vm::OpResult SetConnectorState(int connector, int state_keyword, vm::Cell value) override;
  vm::OpResult GetConnectorState(int connector, int state_keyword, int* value) override;
  bool Docked(int connector) override;
  vm::OpResult SensorTowards(vm::SensorKind kind, int keyword, vm::Direction d,
                             float* value) override;
  vm::OpResult Tilt(vm::Axis axis, float* degrees) override;
  vm::OpResult SensorReading(vm::SensorKind kind, int keyword, float* value) override;
  int64_t RootTimeUs() override;
  int Hops() override;
  int Id() override;
  vm::OpResult Place(vm::Axis axis, float* mm) override;
  vm::OpResult Heading(float* degrees) override;
  float Random() override;
  vm::OpResult Sleep(int64_t duration_us) override;
  vm::OpResult Invoke(int role, int command_slot, const vm::Cell* arguments, int count) override;
  vm::OpResult InvokeNear(uint32_t connector_mask, int role, int command_slot,
                          const vm::Cell* arguments, int count) override;
  uint32_t Telling(uint32_t connector_mask, int role) override;
  uint32_t FirstModule(uint32_t connector_mask) override;
  vm::OpResult NeighbourField(uint32_t connector_mask, int role, int field,
                              vm::Cell* value) override;
  vm::OpResult Print(int text, const vm::Cell* values, int count) override;

 private:
  vm::OpResult Note(const std::string& line, bool wait);
  /// "Role.command(1, 2.5)"
  [[nodiscard]] std::string CallText(int role, int command_slot, const vm::Cell* arguments,
                                     int count) const;
  const vm::VerifiedProgram& program_;
};

/// Everything that one role does: its requirements and labels, then its startups, behaviors (once),
/// commands without parameters and handlers, each to its end. One line an event.
std::vector<std::string> RunRoleNumber(const vm::VerifiedProgram& program, int role);
/// The same for the role of that name.
std::vector<std::string> RunRole(const vm::VerifiedProgram& program, const std::string& role_name);

}  // namespace morphbus::dynarole
