#pragma once
// Numbers and attribute values as people write them in M3L.

#include <string>

#include "compiler/model/robot_model.h"

namespace morphbus::model {

/// A number as a person writes it: up to 9 digits, no trailing zeros, no negative zero.
std::string NumberText(double value);

/// An attribute's value as written in M3L: "male", true, 0.5. Strings get quotes but no escapes, so
/// the text is for messages and not for reading back.
std::string ValueText(const AttributeValue& value);

}  // namespace morphbus::model
