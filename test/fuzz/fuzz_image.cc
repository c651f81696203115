// Any bytes as a program image or a module type's kinematics: refused, or safe to run. An image
// whose hash is wrong is tried again with the right one, so that everything behind the hash is
// reached; an accepted program runs every function on a host that answers arbitrarily.

#include <cstdint>
#include <memory>
#include <vector>

#include "vm/image/image.h"
#include "vm/image/kinematics_verifier.h"
#include "vm/image/set_locals.h"
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
  Axis JointAxis(int) override { return static_cast<Axis>(Next() % kNumAxes); }
  Axis CenterAxis() override { return static_cast<Axis>(Next() % kNumAxes); }
  int Keyword(int) override { return static_cast<int>(Next() % 8); }
  OpResult SetJointAxis(int, int, Axis) override { return Result(); }
  OpResult RotateDegrees(int, float, bool) override { return Result(); }
  OpResult SetDegrees(int, float, bool) override { return Result(); }
  OpResult JointDegrees(int, float* v) override { return Value(v); }
  OpResult JointEffort(int, float* v) override { return Value(v); }
  OpResult JointVelocity(int, float* v) override { return Value(v); }
  OpResult TurnContinuous(int, float) override { return Result(); }
  OpResult MoveMillimetres(int, float, bool) override { return Result(); }
  OpResult SetMillimetres(int, float, bool) override { return Result(); }
  OpResult JointMillimetres(int, float* v) override { return Value(v); }
  OpResult SetPosition(int, float) override { return Result(); }
  OpResult GetPosition(int, float* v) override { return Value(v); }
  OpResult SetConnectorState(int, int, Cell) override { return Result(); }
  OpResult GetConnectorState(int, int, int* v) override {
    *v = static_cast<int>(Next());
    return Result();
  }
  bool Docked(int) override { return Next() % 2 == 0; }
  OpResult SensorTowards(SensorKind, int, Direction, float* v) override {
    *v = static_cast<float>(Next());
    return Result();
  }
  OpResult Tilt(Axis, float* v) override {
    *v = static_cast<float>(Next());
    return Result();
  }
  OpResult SensorReading(SensorKind, int, float* v) override {
    *v = static_cast<float>(Next());
    return Result();
  }
  int64_t RootTimeUs() override { return static_cast<int64_t>(Next()) << 32; }
  int Hops() override { return static_cast<int>(Next()); }
  int Id() override { return static_cast<int>(Next()); }
  OpResult Place(Axis, float* v) override { return Value(v); }
  OpResult Heading(float* v) override { return Value(v); }
  float Random() override { return static_cast<float>(Next() % 256) / 256; }
  OpResult Sleep(int64_t) override { return {FaultCode::kNone, true}; }
  OpResult Invoke(int, int, const Cell*, int) override { return Result(); }
  OpResult InvokeNear(uint32_t, int, int, const Cell*, int) override { return Result(); }
  uint32_t Telling(uint32_t mask, int) override { return mask & Next(); }
  uint32_t FirstModule(uint32_t mask) override { return mask & Next(); }
  OpResult NeighbourField(uint32_t, int, int, Cell* value) override {
    *value = Cell{0};
    return Result();
  }
  OpResult Print(int, const Cell*, int) override { return Result(); }

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
    const RoleInfo role = program.role(r);
    Cell fields[kMaxFields];
    int8_t labels[kMaxLabels] = {};
    for (int i = 0; i < role.num_fields; ++i) fields[i] = role.fields[i];
    const RoleContext context{r, fields, labels};
    int32_t budget = 2000;
    for (int i = 0; i < role.num_requirements; ++i) {
      Evaluate(program, role.requirements[i], context, host, &budget);
    }
    for (int i = 0; i < role.num_labels; ++i) {
      Evaluate(program, role.labels[i], context, host, &budget);
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
    for (int i = 0; i < role.num_startups; ++i) run(role.startups[i]);
    for (int i = 0; i < role.num_behaviors; ++i) run(role.behaviors[i]);
    for (int i = 0; i < role.num_commands; ++i) run(role.commands[i]);
    for (int i = 0; i < role.num_handlers; ++i) run(role.handlers[i].function);
  }
}

/// Reads every name and which variables are set at every byte: none may lie outside the image.
void ReadNotes(const VerifiedProgram& program) {
  volatile size_t sum = 0;
  const auto read = [&sum](const Text& text) {
    for (int i = 0; i < text.size; ++i) sum = sum + static_cast<uint8_t>(text.data[i]);
  };
  read(program.source_name());
  for (int i = 0; i < program.num_imported_files(); ++i) read(program.imported_file(i).name);
  for (int f = 0; f < program.num_functions(); ++f) {
    const FunctionInfo function = program.function(f);
    read(program.function_name(f));
    for (int i = 0; i < function.num_locals; ++i) read(program.local_name(f, i));
    const uint32_t step = 1 + function.code_size / 16;
    for (uint32_t pc = 0; pc < function.code_size; pc += step) {
      sum = sum + static_cast<size_t>(program.LineOf(f, pc)) + SetLocals(program, f, pc);
    }
  }
  for (int r = 0; r < program.num_roles(); ++r) {
    for (int i = 0; i < program.role(r).num_fields; ++i) read(program.field_name(r, i));
  }
}

void Try(const std::vector<uint8_t>& bytes) {
  const auto program = std::make_unique<VerifiedProgram>();
  const auto size = static_cast<uint32_t>(bytes.size());
  if (Verifier::Verify(bytes.data(), size, program.get()).message == nullptr) {
    ReadNotes(*program);
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
    const auto put = [&bytes](uint32_t at, uint64_t value, uint32_t count) {
      for (uint32_t i = 0; i < count; ++i) bytes[at + i] = static_cast<uint8_t>(value >> (8 * i));
    };
    // With hashes that fit, so that damage is met by the checks behind them; what a wrong size
    // would cut off counts as part of what runs.
    const auto total = static_cast<uint32_t>(size);
    uint32_t run = image::ReadU32(bytes.data() + image::kSizeAt);
    if (run < image::kHeaderBytes || run > total) run = total;
    put(image::kSizeAt, run, 4);
    put(image::kNotesHashAt, image::HashOfNotes(bytes.data() + run, total - run), 8);
    put(image::kHashAt, image::HashOf(bytes.data(), run), 8);
    Try(bytes);
  }
  return 0;
}
