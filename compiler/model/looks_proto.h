#pragma once
// How links look, in the message of a model. It stands apart from the links, so that the model's
// hash can leave it out as a whole. Internal to model_proto.cc and model_from_proto.cc.

#include <string>

#include "compiler/model/model.pb.h"
#include "compiler/model/robot_model.h"

namespace morphbus::model {

/// Adds how the links look that do not look like their shapes. Points of a VisualPart are of single
/// precision already, so that nothing is lost.
void WriteLooks(const Model& model, proto::Model* message);

/// Gives the links of `model`, which has all its module types, how they look by `message`, which is
/// not trusted. What is wrong with it, such as "looks 3: link 7 of 2"; empty if nothing is.
std::string ReadLooks(const proto::Model& message, Model* model);

}  // namespace morphbus::model
