// Any bytes as a program image or a module type's kinematics: refused, or safe to run. An image
// whose hash is wrong is tried again with the right one, so that everything behind the hash is
// reached; an accepted program runs every function on a host that answers arbitrarily.

#include <cstdint>
#include <memory>
#include <vector>

#include "vm/image/image.h"
#include "vm/image/kinematics_image.h"
#include "vm/image/verifier.h"
#include "vm/run/interpreter.h"

namespace {

using namespace morphbus::vm;

/// Answers from the input's bytes; remembers nothing.
class ArbitraryHost final : public ProgramHost {
 public:
  explicit ArbitraryHost(const std::vector<uint8_t>& bytes) : bytes_(bytes) {}

  uint32_t Connected(Direction) override { return Next(); }
  uint32_t ConnectedRole(Direction, int) override { return Next(); }
  int CountModules(uint32_t mask) override { return __builtin_popcount(mask); }
  uint32_t Joints(Axis, int) override { return Next(); }
  uint32_t Links(int) override { return Next(); }
  Axis JointAxis(int) override { return static_cast<Axis>(Next() % 4); }
  Axis CenterAxis() override { return static_cast<Axis>(Next() % 4); }
  int Keyword(int) override { return static_cast<int>(Next() % 8); }
  OpResult SetJointAxis(int, int, Axis) override { return Result(); }
  OpResult RotateDegrees(int, float, bool) override { return Result(); }
  OpResult SetDegrees(int, float, bool) override { return Result(); }
  OpResult JointDegrees(int, float* v) override { return Value(v); }
  OpResult TurnContinuous(int, float) override { return Result(); }
  OpResult MoveMillimetres(int, float) override { return Result(); }
  OpResult SetPosition(int, float) override { return Result(); }
  OpResult GetPosition(int, float* v) override { return Value(v); }
  OpResult SetConnectorState(int, int, Cell) override { return Result(); }
  OpResult Sleep(int64_t) override { return {FaultCode::kNone, true}; }
  OpResult Invoke(int, int, const Cell*, int) override { return Result(); }

 private:
  uint32_t Next() { return bytes_.empty() ? 0u : bytes_[at_++ % bytes_.size()]; }
  OpResult Result() {
    return {Next() % 7 == 0 ? FaultCode::kBadInvocation : FaultCode::kNone, false};
  }
  OpResult Value(float* v) {
    *v = static_cast<float>(Next());
    return Result();
  }
  const std::vector<uint8_t>& bytes_;
  size_t at_ = 0;
};

void RunEverything(const VerifiedProgram& program, const std::vector<uint8_t>& bytes) {
  ArbitraryHost host(bytes);
  for (int r = 0; r < program.num_roles(); ++r) {
    const RoleInfo& role = program.role(r);
    Cell fields[kMaxFields];
    int8_t labels[kMaxLabels] = {};
    for (int i = 0; i < role.num_fields; ++i) fields[i] = role.fields[i];
    const RoleContext context{r, fields, labels};
    int32_t budget = 2000;
    for (int i = 0; i < role.num_requirements; ++i) {
      Evaluate(program, role.requirements[i], context, host, &budget);
    }
    for (int i = 0; i < role.num_labels; ++i) {
      Evaluate(program, role.labels[i].function, context, host, &budget);
    }
    const auto run = [&](int function) {
      TaskState task{};
      const Cell arguments[kMaxArguments] = {};
      StartTask(program, function, arguments, program.function(function).num_arguments, &task);
      for (int turns = 0; turns < 4; ++turns) {
        int32_t slice = 500;
        if (RunTask(program, context, host, &task, &slice).status == RunStatus::kFinished) break;
      }
    };
    for (int i = 0; i < role.num_startups; ++i) run(role.startups[i].function);
    for (int i = 0; i < role.num_behaviors; ++i) run(role.behaviors[i].function);
    for (int i = 0; i < role.num_commands; ++i) run(role.commands[i].function);
    for (int i = 0; i < role.num_handlers; ++i) run(role.handlers[i].function);
  }
}

void Try(const std::vector<uint8_t>& bytes) {
  const auto program = std::make_unique<VerifiedProgram>();
  const auto size = static_cast<uint32_t>(bytes.size());
  if (Verifier::Verify(bytes.data(), size, program.get()).message == nullptr) {
    RunEverything(*program, bytes);
  }
  const auto kinematics = std::make_unique<VerifiedKinematics>();
  if (VerifyKinematics(bytes.data(), size, kinematics.get()).message == nullptr) {
    for (int i = 0; i < kinematics->num_connections(); ++i) {
      const KinConnection c = kinematics->connection(i);
      if (c.connector >= kinematics->num_connectors()) __builtin_trap();
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  std::vector<uint8_t> bytes(data, data + size);
  Try(bytes);
  if (size >= image::kHeaderBytes) {
    const auto total = static_cast<uint32_t>(size);
    for (uint32_t i = 0; i < 4; ++i) {
      bytes[image::kSizeAt + i] = static_cast<uint8_t>(total >> (8 * i));
    }
    const uint64_t hash = image::HashOf(bytes.data(), total);
    for (uint32_t i = 0; i < 8; ++i) {
      bytes[image::kHashAt + i] = static_cast<uint8_t>(hash >> (8 * i));
    }
    Try(bytes);
  }
  return 0;
}
