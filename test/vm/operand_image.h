#pragma once
// An image in which every instruction has something to refer to, good and bad.

#include <vector>

#include "test/vm/image_builder.h"

namespace morphbus::vm {

/// The numbers of things in the image of OperandImage.
enum Function { kTested, kCommand, kMethod, kBaseMethod, kJointLabel, kLinkLabel, kUnrelated };
enum Constant { kInt, kFloat, kBool, kDirection, kAxis, kRole, kTextConstant, kNumConstants };
/// Behind them stand the first values of the roles' fields, and nothing behind those.
inline constexpr int kNumFields = 6, kNoConstant = kNumConstants + kNumFields;
enum Keyword {
  kJointKeyword,
  kConnectorKeyword,
  kStateKeyword,
  kSensorKeyword,
  kSensorKindKeyword,
  kNumKeywords
};
enum Local { kIntLocal, kFloatLocal, kUnsetLocal, kNumLocals };
/// What the function under test is, or what calls it.
enum class Place { kTask, kRequirement, kLabel, kCalledByRequirement, kCalledByLabel };
inline constexpr int kCaller = 7;
inline constexpr int kBase = 1, kOther = 2, kSharing = 3, kNumRoles = 4;

/// Code that pushes a value of this type.
Code Value(ValueType type);

/// What a function in this place returns, or its caller.
ValueType ResultIn(Place place);

/// Puts a requirement or label into role R, the first of the image, that is the function under test
/// or calls it.
void PutInto(Place place, TestImage* image);

/// The bytes that stand before `code` in the function under test.
inline constexpr int kBytesBefore = 10;

/// The program: `code` is a startup of role 0, its joins are counted from its beginning, and it
/// returns `result`.
TestImage OperandImage(const Code& code, const std::vector<TestJoin>& joins, ValueType result);

}  // namespace morphbus::vm
