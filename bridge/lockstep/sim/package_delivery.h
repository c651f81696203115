#pragma once
// A program on its way from outside to the module from where it spreads.

#include <cstdint>
#include <morphbus/sensors_t.hpp>
#include <optional>
#include <vector>

#include "bridge/lockstep/sim/run_members.h"

namespace morphbus::bridge {

/// Gives a module a package (vm/spread/package.h), one piece a tick, so that SENSORS stays within a
/// datagram. In lockstep every piece arrives; in real time they are repeated until the module tells
/// its neighbours that it has the package. Modules are called by their place in the run.
class PackageDelivery {
 public:
  PackageDelivery(const std::vector<ExpectedModule>& modules, bool realtime);

  /// Begins to give a package to a module. One that has not gone out whole by now is withdrawn, so
  /// that no module runs it.
  /// @param id         by which its pieces are told from others'.
  /// @param package    verified by the caller; at least one byte, at most vm::kMaxPackageBytes.
  /// @param from_tick  the first tick that takes a piece.
  void Deploy(size_t module, uint64_t id, const std::vector<uint8_t>& package, int64_t from_tick);
  /// Whether the package that was deployed last has gone out whole, so that it is run.
  [[nodiscard]] bool whole() const { return !delivery_ || delivery_->rounds > 0; }

  /// Puts the piece that is due at a tick into a part of its SENSORS, if the module's reading
  /// stands there, in the place of what stood there.
  /// @param members  the modules of the part.
  void AddTo(const std::vector<size_t>& members, int64_t tick, morphbus::sensors_t* part);

  /// Real time: the module that is to tell its neighbours that it has the package, if pieces are
  /// under way.
  [[nodiscard]] std::optional<size_t> awaited() const;
  /// A module tells its neighbours that it has the package of this id.
  void OnNews(size_t module, uint64_t id);

 private:
  struct Delivery {
    size_t module = 0;
    uint64_t id = 0;
    std::vector<uint8_t> package;
    int64_t from_tick = 0;
    /// Bytes that have gone out, and how often all of them have.
    size_t sent = 0;
    int rounds = 0;
    bool arrived = false;  ///< Real time: its module has it.
  };

  std::vector<uint16_t> ids_;  ///< By place.
  bool realtime_;
  std::optional<Delivery> delivery_;
};

}  // namespace morphbus::bridge
