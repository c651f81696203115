#pragma once
// The connections of a robot while it runs: which connectors are mated, what the modules sense of
// it, and what commands and people change. Knows no physics, so that robots with and without bodies
// share it.

#include <functional>
#include <memory>
#include <morphbus/connector_command_t.hpp>
#include <morphbus/module_sensors_t.hpp>
#include <string>
#include <vector>

#include "compiler/base/result.h"
#include "compiler/model/robot_model.h"
#include "sim/docking.h"

namespace morphbus::sim {

/// Where every link is now (X_WL). It is asked for only when a free connector may find a mate.
using LinkPosesNow = std::function<LinkPoseTable()>;

/// A robot whose connections come and go. The class that moves the bodies makes them anew after a
/// change.
class Connections {
 public:
  /// As the model assembles `robot`, with connectors in the states that its connections need.
  Connections(std::shared_ptr<const model::Model> model, const model::Robot& robot);

  /// The robot with the connections it has now.
  [[nodiscard]] const model::Robot& robot() const { return robot_; }

  /// Fills in what each module's connectors are mated to, in order of connectors; `out` has an
  /// entry a module, in order of module id.
  void Sense(std::vector<morphbus::module_sensors_t>* out) const;

  /// Sets a state variable as commanded: a connection that it no longer allows comes apart, and a
  /// free connector that now fits what lies before it joins it. Returns whether a connection
  /// changed. Commands of connectors, variables or values that there are not are ignored.
  bool Command(int module, const morphbus::connector_command_t& command,
               const LinkPosesNow& link_poses);

  /// Takes this connector off its mate. Fails, in one sentence, if it has none.
  Result<void> Disconnect(const std::string& module, const std::string& connector);

  /// Joins this free connector to the free one it meets (kDockingDistance, kDockingAngle), setting
  /// the state variables of both as the connection needs. Fails if none is near enough, or if it is
  /// another one than that of `mate_module`, where this is given.
  Result<void> Connect(const std::string& module, const std::string& connector,
                       const LinkPosesNow& link_poses, const std::string& mate_module = "",
                       const std::string& mate_connector = "");

 private:
  /// One connector of one module, by indices.
  struct End {
    int module = 0;
    int connector = 0;
  };
  /// The connector by names. Fails if the robot has no such module or connector.
  Result<End> FindEnd(const std::string& module, const std::string& connector) const;
  void Undock(size_t docking);
  void Dock(const model::Docking& docking);
  /// Works out what modules read of the dockings that there are now.
  void NoteReadings();

  std::shared_ptr<const model::Model> model_;
  model::Robot robot_;
  /// What the connectors' state variables are now.
  ConnectorStates states_;
  /// What connectors read, in order of module and connector, with the module that reads it: the
  /// same in every tick until a docking changes.
  std::vector<std::pair<int, morphbus::docked_connector_t>> readings_;
};

}  // namespace morphbus::sim
