// Names of parameters and variables in the notes, and which of them have a value where.

#include "vm/image/set_locals.h"

#include <string>

#include "test/vm/lone_module.h"

namespace morphbus::vm {
namespace {

using SetLocalsTest = LoneModuleTest;

constexpr char kLoops[] = R"(role R extends Module {
  x = 0.0;
  behavior b() {
    var a = 1;
    while (a < 3) {
      var inner = 2.5;
      a += 1;
      x = scaled(inner, a);
    }
    x = 7.0;
  }
  function scaled(value, times) {
    if (times > 2) {
      var half = value / 2;
      return half;
    }
    return value;
  }
}
)";

/// The function of this name.
int FunctionOf(const VerifiedProgram& program, const std::string& name) {
  for (int f = 0; f < program.num_functions(); ++f) {
    const Text text = program.function_name(f);
    if (std::string(text.data, text.size) == name) return f;
  }
  ADD_FAILURE() << "no function " << name;
  return 0;
}

/// The names of the variables that have a value where the code of a line begins, in their order.
std::string SetAt(const VerifiedProgram& program, int function, int line) {
  const FunctionInfo info = program.function(function);
  for (uint32_t pc = 0; pc < info.code_size; ++pc) {
    if (program.LineOf(function, pc) != line) continue;
    std::string names;
    for (int i = 0; i < info.num_locals; ++i) {
      if ((SetLocals(program, function, pc) >> i & 1) == 0) continue;
      const Text name = program.local_name(function, i);
      names += (names.empty() ? "" : " ") + std::string(name.data, name.size);
    }
    return names;
  }
  return "no code";
}

TEST_F(SetLocalsTest, VariablesAreKnownByNameFromWhereTheyAreSet) {
  robot_ = test::ChainRobot(model_, 1);
  const VmRobot vms(model_, robot_, test::ProgramFrom(kLoops, model_), {});
  const VerifiedProgram& program = vms.program();
  const int b = FunctionOf(program, "R.b"), scaled = FunctionOf(program, "R.scaled");
  EXPECT_EQ(SetAt(program, b, 4), "");
  EXPECT_EQ(SetAt(program, b, 5), "a");
  EXPECT_EQ(SetAt(program, b, 6), "a");
  EXPECT_EQ(SetAt(program, b, 7), "a inner");
  EXPECT_EQ(SetAt(program, b, 8), "a inner");
  EXPECT_EQ(SetAt(program, b, 10), "a") << "the scope is over";
  // Parameters always are.
  EXPECT_EQ(SetAt(program, scaled, 13), "value times");
  EXPECT_EQ(SetAt(program, scaled, 15), "value times half");
  EXPECT_EQ(SetAt(program, scaled, 17), "value times");
}

}  // namespace
}  // namespace morphbus::vm
