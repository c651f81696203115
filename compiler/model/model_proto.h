#pragma once
// The model as Protocol Buffers: how it is kept in files, in logs, and handed between processes.

#include <cstdint>
#include <string>
#include <string_view>

#include "compiler/base/result.h"
#include "compiler/model/model.pb.h"
#include "compiler/model/robot_model.h"

namespace morphbus::model {

/// The model as a message, with the kinematic graph of each robot at its start values.
proto::Model ToProto(const Model& model);

/// The model of a message that may be damaged or hostile: every index, size, number, pose and name
/// is checked, so that a model that comes back is as sound as one from the compiler. The error
/// names the place: "robot 'quadruped', connection 3: option 99 of 72".
Result<Model> FromProto(const proto::Model& message);

/// ToProto as bytes; the same model always gives the same bytes.
std::string SerializeModel(const Model& model);

/// ToProto as text for people, a field a line: what `check --dump model` prints.
std::string ModelText(const Model& model);

/// Reads what SerializeModel wrote; at most 64 MiB.
Result<Model> ParseModel(std::string_view bytes);

/// The bytes of a serialized model without how its links look. Bytes that are no model, or hold
/// nothing of the kind, stay as they are.
std::string WithoutLooks(std::string_view bytes);

/// Hash that names a model in images, run descriptions and logs: XXH64 of its serialized bytes
/// WithoutLooks, so that robots that look otherwise are still the same to whoever runs them.
uint64_t ModelHash(std::string_view bytes);

}  // namespace morphbus::model
