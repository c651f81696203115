#pragma once
// What computes a module's ticks.

#include <cstdint>
#include <morphbus/deploy_piece_t.hpp>
#include <morphbus/status_t.hpp>
#include <vector>

#include "vm/module_api.h"

namespace morphbus::bridge {

/// What computes a module's ticks: the VM (bridge/module/vm_controller.h) or a test's fake. It
/// knows neither bus nor lockstep: whatever it needs stands in a tick's input.
class ModuleController {
 public:
  virtual ~ModuleController() = default;
  /// Computes one tick, and writes all of `*output`. Equal history of inputs gives equal output.
  virtual void Tick(const vm::TickInput& input, vm::TickOutput* output) = 0;
  /// A piece of a new program from outside, of the tick that is computed next; pieces come in
  /// order.
  virtual void TakePiece(const morphbus::deploy_piece_t& piece) = 0;
  /// The report, which is that of the last tick, as messages of at most kMaxPayloadBytes (several
  /// if not all fits into one). `inspected`: with all that the module holds.
  virtual std::vector<morphbus::status_t> Describe(const vm::StatusReport& report,
                                                   bool inspected) = 0;
  /// Appends the whole state that changes from tick to tick, so that a resumed process can go on
  /// from it.
  virtual void Save(std::vector<uint8_t>* out) = 0;
  /// Goes on from what Save wrote; false if it is not a state of this build, and then the
  /// controller must not be used any more.
  virtual bool Load(const uint8_t* data, size_t size) = 0;
};

}  // namespace morphbus::bridge
