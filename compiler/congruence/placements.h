#pragma once
// The ways in which a module can stand in for another of its type. Internal to variants.cc.

#include <Eigen/Core>
#include <vector>

#include "compiler/model/robot_model.h"

namespace morphbus::congruence {

/// A congruence of a module type with itself.
struct Placement {
  std::vector<int> body_of;  ///< [link]; links that fixed joints hold together are one body.
  std::vector<int> body_to;  ///< [body] -> body.
  /// [body]: takes coordinates in the frame of the body's links, about the module's origin, to
  /// coordinates in that of the image's.
  std::vector<Eigen::Matrix3d> C;
  struct JointImage {
    int to = 0;
    double sign = 1.0;
    double offset = 0.0;
  };
  std::vector<JointImage> joints;  ///< [joint]; fixed ones stay.
  bool identity = false;
};

/// All of them but those that differ from one before only in bodies that carry no connectors; the
/// identity first. Where a turn is free (a wheel about its own axis), those turns
/// that take some connector to the place of another.
std::vector<Placement> PlacementsOf(const model::Model& model, int type);

}  // namespace morphbus::congruence
