#include "logger/log/ended_tasks.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace morphbus::logger {
namespace {

/// Tells EndedTasks of modules' STATUS, as the reader of logs does.
class EndedTasksTest : public ::testing::Test {
 protected:
  /// A STATUS of a module at a tick; `behaviors` and `startup` are what has ended by then.
  static morphbus::status_t Status(int64_t tick, int behaviors, bool startup = false) {
    morphbus::status_t status{};
    status.header.tick = tick;
    status.header.program_hash = 7;
    status.incarnation = 1;
    status.role_name = "Leg";
    status.ended_behaviors = static_cast<int8_t>(behaviors);
    status.startup_ended = startup ? 1 : 0;
    return status;
  }
  /// A fault that has ended a task.
  static morphbus::fault_t Fault(vm::TaskKind kind, int line, int function) {
    morphbus::fault_t fault{};
    fault.code = static_cast<int16_t>(vm::FaultCode::kDivisionByZero);
    fault.line = static_cast<int16_t>(line);
    fault.ended_task = static_cast<int8_t>(kind);
    fault.task_function = static_cast<int16_t>(function);
    return fault;
  }
  void Take(const std::string& module, morphbus::status_t status,
            std::vector<morphbus::fault_t> faults = {}) {
    status.faults = std::move(faults);
    status.num_faults = static_cast<int8_t>(status.faults.size());
    ended_.Take({.time_us = status.header.tick * 20'000,
                 .module = module,
                 .type_name = {},
                 .role = status.role_name,
                 .program_hash = static_cast<uint64_t>(status.header.program_hash),
                 .text = {},
                 .file = {}},
                status);
  }
  /// What has ended, with tasks named as a log without images names them.
  [[nodiscard]] EndedFacts Facts(const std::map<std::string, int64_t>& lost = {}) const {
    EndedFacts facts = ended_.Facts(lost);
    for (FaultFact& fault : facts.faults) {
      fault.task = vm::FaultTask(fault.fault, nullptr);
      fault.file = "walk.dyn";
    }
    return facts;
  }
  [[nodiscard]] std::vector<std::string> Lines() const { return EndedLines(Facts()); }

  EndedTasks ended_;
};

TEST_F(EndedTasksTest, AreCountedAndNamedTheEarliestFirst) {
  Take("m10", Status(5, 1), {Fault(vm::TaskKind::kBehavior, 7, 3)});
  Take("m2", Status(5, 1), {Fault(vm::TaskKind::kBehavior, 7, 3)});
  Take("m1", Status(9, 0, true), {Fault(vm::TaskKind::kStartup, 4, 2)});
  // What runs again and what ended nothing is not among them.
  Take("m3", Status(2, 0), {Fault(vm::TaskKind::kHandler, 9, 5)});
  EXPECT_EQ(Lines(), (std::vector<std::string>{
                         "2 behaviors have ended by a fault: m2, m10 function 3 (walk.dyn:7)",
                         "1 startup has ended by a fault, and nothing else of the role has "
                         "started: m1 function 2 (walk.dyn:4)"}));
  const nlohmann::json json = EndedJson(Facts());
  EXPECT_EQ(json["behaviors"], 2);
  EXPECT_EQ(json["startups"], 1);
  ASSERT_EQ(json["tasks"].size(), 3u);
  EXPECT_EQ(json["tasks"][2], (nlohmann::json{{"module", "m1"},
                                              {"time", 0.18},
                                              {"role", "Leg"},
                                              {"kind", "startup"},
                                              {"function", "function 2"},
                                              {"file", "walk.dyn"},
                                              {"line", 4}}));
}

TEST_F(EndedTasksTest, AllAreCountedAndTenNamed) {
  for (int i = 1; i <= 13; ++i) {
    Take("m" + std::to_string(i), Status(2 * i, 1), {Fault(vm::TaskKind::kBehavior, 7, 3)});
  }
  // A module that could not tell of all, in time the tenth.
  Take("m14", Status(19, 5), {Fault(vm::TaskKind::kBehavior, 8, 4)});
  ASSERT_EQ(Lines().size(), 1u);
  EXPECT_TRUE(Lines()[0].starts_with("18 behaviors have ended by a fault: m1, m2, m3, "))
      << Lines()[0];
  EXPECT_TRUE(
      Lines()[0].ends_with(", m9 function 3 (walk.dyn:7); m14 function 4 (walk.dyn:8) and 8 more"))
      << Lines()[0];
}

TEST_F(EndedTasksTest, WhoeverBeginsAfreshHasNone) {
  const auto dies = [&](const std::string& module) {
    Take(module, Status(5, 1), {Fault(vm::TaskKind::kBehavior, 7, 3)});
  };
  morphbus::status_t afresh = Status(6, 0);
  dies("m1");
  afresh.role = 1;  // Another role.
  Take("m1", afresh);
  dies("m2");
  afresh = Status(6, 0);
  afresh.header.program_hash = 8;  // A new program.
  Take("m2", afresh);
  dies("m3");
  afresh = Status(6, 0);
  afresh.incarnation = 2;  // A cold start.
  Take("m3", afresh);
  dies("m4");
  Take("m4", Status(7, 0));  // The role was left and taken again between two messages.
  EXPECT_TRUE(Lines().empty()) << Lines()[0];
  // Under the new program one dies, which is the only one told of.
  afresh = Status(9, 1);
  afresh.header.program_hash = 8;
  Take("m2", afresh, {Fault(vm::TaskKind::kBehavior, 2, 1)});
  EXPECT_EQ(
      Lines(),
      (std::vector<std::string>{"1 behavior has ended by a fault: m2 function 1 (walk.dyn:2)"}));
}

TEST_F(EndedTasksTest, OfOneTickThereMayBeSeveralMessagesAndALateOneTellsNothing) {
  Take("m1", Status(5, 2), {Fault(vm::TaskKind::kBehavior, 7, 3)});
  Take("m1", Status(5, 2), {Fault(vm::TaskKind::kBehavior, 8, 4)});
  Take("m1", Status(4, 0));
  EXPECT_EQ(Facts().behaviors, 2);
  EXPECT_EQ(Facts().faults.size(), 2u);
}

TEST_F(EndedTasksTest, OfALostModuleNothingIsExpected) {
  Take("m1", Status(5, 1), {Fault(vm::TaskKind::kBehavior, 7, 3)});
  EXPECT_EQ(Facts({{"m1", 100'000}}).behaviors, 0);
}

}  // namespace
}  // namespace morphbus::logger
