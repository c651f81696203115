#pragma once
// Connectors that docked or parted while a run went on.

#include <cstdint>
#include <map>
#include <morphbus/docked_connector_t.hpp>
#include <morphbus/module_sensors_t.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::logger {

struct LogFacts;

/// Two connectors that docked or parted.
struct DockingFact {
  /// Sim time of the first SENSORS that shows it, µs.
  int64_t time_us = 0;
  /// True if they docked, false if they parted.
  bool docked = false;
  /// MODULE.CONNECTOR, the one of the module with the lower number first; a connector that the
  /// model does not name has its number, from 0.
  std::string connector, mate;
};

/// Follows what is docked to what, message by message.
class DockingChanges {
 public:
  /// What a module senses at a sim time (µs). The first reading of each module is no change, and
  /// one of an earlier time than one taken before tells nothing new.
  void Take(const morphbus::module_sensors_t& reading, int64_t time_us);
  /// Tells `facts` of the first 1000 changes, in order of time, and how many there were. Its mates
  /// sense a lost module no more, but nothing says that its connectors opened. `model` and `robot`
  /// are null without a description.
  void Tell(const model::Model* model, const model::Robot* robot, LogFacts* facts) const;

 private:
  /// A docking as its module senses it: own connector, the mate's module and connector.
  using Docking = std::tuple<int, int, int>;
  /// A module, the time of its newest reading, and what that showed.
  struct Module {
    std::string name;
    int64_t time_us = -1;
    std::vector<morphbus::docked_connector_t> docked;
  };
  /// One docking that came or went.
  struct Change {
    int64_t time_us = 0;
    bool docked = false;
    int module = 0;
    Docking docking;
  };
  void Note(int module, int64_t time_us, bool docked, const Docking& docking);
  /// Whether the change only shows that one of the two modules was lost.
  [[nodiscard]] bool OfLoss(const Change& change, const LogFacts& facts) const;
  /// MODULE.CONNECTOR, by the numbers of both.
  [[nodiscard]] std::string Name(const model::Model* model, const model::Robot* robot, int module,
                                 int connector) const;

  std::map<int, Module> modules_;
  std::vector<Change> changes_;
  int64_t count_ = 0;
};

/// A paragraph for `info`: a line a change. Empty without any.
std::string DockingsText(const std::vector<DockingFact>& dockings, int64_t count);

}  // namespace morphbus::logger
