// The interpreter beside Lua 5.4: the same loops, comparisons, calls, arrays and neighbours, a
// million rounds each. A neighbour is a table with a field in Lua, and one of the test's host in
// the VM. The VM accounts for its instruction budget on the way. Compare the CPU times of
// BM_Vm/NAME and BM_Lua/NAME; the goal is that the VM needs no more.

#include <benchmark/benchmark.h>
#include <lua5.4/lua.hpp>

#include <cstdlib>
#include <memory>
#include <string>

#include "compiler/dynarole/compile.h"
#include "test/compiler/dynarole/fake_host.h"
#include "vm/image/verifier.h"
#include "vm/run/interpreter.h"

namespace morphbus {
namespace {

constexpr int kRounds = 1000000;

constexpr char kDynaRole[] = R"(
role R extends Module {
  function add(int a, int b) { return a + b; }
  function arithmetic() {
    var a = 1;
    for (var i = 0; i < 1000000; i += 1) { a = (a * 3 + i) % 65536; }
    return a;
  }
  function loop() {
    var i = 0;
    while (i < 1000000) { i += 1; }
    return i;
  }
  function comparisons() {
    var n = 0;
    for (var i = 0; i < 1000000; i += 1) {
      if (i % 3 == 0) { n += 1; } else if (i > 500000) { n += 2; }
    }
    return n;
  }
  function calls() {
    var n = 0;
    for (var i = 0; i < 1000000; i += 1) { n = add(n, i) % 1000; }
    return n;
  }
  function arrays() {
    var a = [0, 0, 0, 0, 0, 0, 0, 0];
    for (var i = 0; i < 1000000; i += 1) {
      var at = i % 8;
      a[at] = (a[at] + i) % 1000;
    }
    return a[0] + a[1] + a[2] + a[3] + a[4] + a[5] + a[6] + a[7];
  }
  function neighbours() {
    var n = 0.0;
    for (var i = 0; i < 500000; i += 1) {
      for (other in self.connected($ANY, $Many)) n = other.load - n;
    }
    return int(n * 10);
  }
  function neighbours_sum() {
    var n = 0.0;
    for (var i = 0; i < 500000; i += 1) n = sum(self.connected($ANY, $Many).load) - n;
    return int(n * 10);
  }
  startup go() { arithmetic(); loop(); comparisons(); calls(); arrays(); neighbours(); neighbours_sum(); }
}
role Many extends Module {
  require self.connected($UP) == 1;
  shared load = 1.5;
  startup own() {}
})";

constexpr char kLua[] = R"(
local function add(a, b) return a + b end
function arithmetic()
  local a = 1
  for i = 0, 999999 do a = (a * 3 + i) % 65536 end
  return a
end
function loop()
  local i = 0
  while i < 1000000 do i = i + 1 end
  return i
end
function comparisons()
  local n = 0
  for i = 0, 999999 do
    if i % 3 == 0 then n = n + 1 elseif i > 500000 then n = n + 2 end
  end
  return n
end
function calls()
  local n = 0
  for i = 0, 999999 do n = add(n, i) % 1000 end
  return n
end
function arrays()
  local a = {0, 0, 0, 0, 0, 0, 0, 0}
  for i = 0, 999999 do
    local at = i % 8 + 1
    a[at] = (a[at] + i) % 1000
  end
  return a[1] + a[2] + a[3] + a[4] + a[5] + a[6] + a[7] + a[8]
end
local connected = {{load = 1.5}, {load = 3.5}}
function neighbours()
  local n = 0.0
  for _ = 1, 500000 do
    for _, other in ipairs(connected) do n = other.load - n end
  end
  return n * 10 // 1 | 0
end
function neighbours_sum()
  local n = 0.0
  for _ = 1, 500000 do
    local total = 0.0
    for _, other in ipairs(connected) do total = total + other.load end
    n = total - n
  end
  return n * 10 // 1 | 0
end)";

/// What the function returns in Lua, which the VM must return, too.
int64_t RunLua(lua_State* lua, const char* name) {
  lua_getglobal(lua, name);
  lua_call(lua, 0, 1);
  const int64_t value = lua_tointeger(lua, -1);
  lua_pop(lua, 1);
  return value;
}

struct Lua {
  Lua() {
    luaL_openlibs(state);
    if (luaL_dostring(state, kLua) != LUA_OK) std::abort();
  }
  Lua(const Lua&) = delete;
  Lua& operator=(const Lua&) = delete;
  ~Lua() { lua_close(state); }
  lua_State* state = luaL_newstate();
};

void BM_Lua(benchmark::State& state, const char* name) {
  const Lua lua;
  for (auto _ : state) benchmark::DoNotOptimize(RunLua(lua.state, name));
  state.SetItemsProcessed(state.iterations() * kRounds);
}

void BM_Vm(benchmark::State& state, const char* name) {
  const dynarole::CompileResult compiled =
      dynarole::CompileProgram("bench.dyn", kDynaRole, dynarole::TestKeywords());
  const auto program = std::make_unique<vm::VerifiedProgram>();
  if (!compiled.image ||
      vm::Verifier::Verify(compiled.image->data(), static_cast<uint32_t>(compiled.image->size()),
                           program.get())
              .message != nullptr) {
    return state.SkipWithError("the program does not compile");
  }
  int function = 0;
  for (int i = 0; i < program->num_functions(); ++i) {
    const vm::Text text = program->member_name(i);
    if (std::string(text.data, text.size) == name) function = i;
  }
  dynarole::FakeHost host(*program);
  vm::Cell fields[vm::kMaxFields];
  int8_t labels[vm::kMaxLabels] = {};
  const vm::RoleContext role{0, fields, labels};
  const int64_t expected = RunLua(Lua().state, name);
  for (auto _ : state) {
    vm::TaskState task;
    vm::StartTask(*program, function, nullptr, 0, &task);
    int32_t budget = 100 * kRounds;
    const vm::RunResult result = vm::RunTask(*program, role, host, &task, &budget);
    if (result.status != vm::RunStatus::kFinished || result.value.AsInt() != expected) {
      return state.SkipWithError("another result than Lua's");
    }
  }
  state.SetItemsProcessed(state.iterations() * kRounds);
}

BENCHMARK_CAPTURE(BM_Vm, arithmetic, "arithmetic")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Lua, arithmetic, "arithmetic")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Vm, loop, "loop")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Lua, loop, "loop")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Vm, comparisons, "comparisons")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Lua, comparisons, "comparisons")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Vm, calls, "calls")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Lua, calls, "calls")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Vm, arrays, "arrays")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Lua, arrays, "arrays")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Vm, neighbours, "neighbours")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Lua, neighbours, "neighbours")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Vm, neighbours_sum, "neighbours_sum")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(BM_Lua, neighbours_sum, "neighbours_sum")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace morphbus

BENCHMARK_MAIN();
