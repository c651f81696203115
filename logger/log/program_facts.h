#pragma once
// What the programs of modules report in STATUS, as a log has it.

#include <cstdint>
#include <string>

#include "vm/image/fault_text.h"
#include "vm/module_api.h"

namespace morphbus::logger {

/// What a module's program made it report in STATUS, and where.
struct ProgramFact {
  /// Sim time of the STATUS that reported it, µs.
  int64_t time_us = 0;
  std::string module;
  /// Module type of `module`, by which joints and connectors are named.
  std::string type_name;
  /// Role of the module at that time; empty if it had none.
  std::string role;
  /// Hash of the program that ran, which may be another one than the description's.
  uint64_t program_hash = 0;
  /// What it says, with names as far as the log's images have them (WordFaults).
  std::string text;
  /// The source file from which it comes, in which WordFaults then counts the line; empty if
  /// unknown.
  std::string file;
};

/// A fault of the robot's program. It says something of the robot, and nothing of the log.
struct FaultFact : ProgramFact {
  vm::Fault fault;
  /// The function in which it happened; empty if in none.
  std::string function;
  /// The function of the task that it has ended; empty if it has ended none.
  std::string task;

  /// Place, sentence and function on one line, as every tool prints them.
  [[nodiscard]] std::string Line() const { return vm::FaultLine(file, fault.line, text, function); }
};

/// A line that a program printed.
struct PrintFact : ProgramFact {
  vm::PrintReport print;

  /// Place and text on one line, as every tool prints them.
  [[nodiscard]] std::string Line() const { return vm::FaultLine(file, print.line, text, ""); }
};

}  // namespace morphbus::logger
