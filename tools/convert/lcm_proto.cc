#include "tools/convert/lcm_proto.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>
#include <google/protobuf/message.h>
#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <map>
#include <set>
#include <vector>

#include "tools/base/json.h"

namespace morphbus::tools {

namespace pb = google::protobuf;

/// What Protocol Buffers know of the type.
struct LcmProto::Parts {
  pb::DescriptorPool pool;
  pb::DynamicMessageFactory factory;
  const pb::Message* prototype = nullptr;
};

namespace {

using LcmJson = nlohmann::ordered_json;

/// The field's type; TYPE_MESSAGE for what is no primitive.
pb::FieldDescriptorProto::Type FieldType(const LcmMember& member) {
  using Field = pb::FieldDescriptorProto;
  // Protocol Buffers have no integers of 8 and 16 bits; sint is their encoding in which negative
  // numbers are short, too.
  static const std::map<std::string, Field::Type> types = {
      {"int8_t", Field::TYPE_SINT32},  {"int16_t", Field::TYPE_SINT32},
      {"int32_t", Field::TYPE_SINT32}, {"int64_t", Field::TYPE_SINT64},
      {"float", Field::TYPE_FLOAT},    {"double", Field::TYPE_DOUBLE},
      {"string", Field::TYPE_STRING},  {"boolean", Field::TYPE_BOOL},
      {"byte", Field::TYPE_UINT32}};
  if (member.type == "byte" && !member.dimensions.empty()) return Field::TYPE_BYTES;
  const auto found = types.find(member.type);
  return found == types.end() ? Field::TYPE_MESSAGE : found->second;
}

/// Whether the field is a list: bytes in a row are one value.
bool IsRepeated(const LcmMember& member) {
  return member.dimensions.size() > (member.type == "byte" ? 1u : 0u);
}

/// The package in a full name; empty if it has none.
std::string PackageOf(const std::string& full) {
  return full.substr(0, full.find('.') == std::string::npos ? 0 : full.rfind('.'));
}

/// The file in which a package's types are defined.
std::string FileOf(const std::string& package) {
  return (package.empty() ? "types" : package) + ".proto";
}

/// The names of a type and of all types within it.
void CollectTypes(const LcmSchema& schema, const LcmType& type, std::set<std::string>* names) {
  // A name that is there already ends the recursion, also where types hold each other.
  if (!names->insert(type.name).second) return;
  for (const LcmMember& member : type.members) {
    const LcmType* nested = schema.FindByName(member.type);
    if (nested != nullptr) CollectTypes(schema, *nested, names);
  }
}

/// Adds a type to the file of its package.
void Define(const LcmType& type, pb::FileDescriptorProto* file) {
  pb::DescriptorProto* message = file->add_message_type();
  // The package is the file's; without a dot rfind + 1 is 0, and the name is whole.
  message->set_name(type.name.substr(type.name.rfind('.') + 1));
  int number = 0;
  for (const LcmMember& member : type.members) {
    pb::FieldDescriptorProto* field = message->add_field();
    field->set_name(member.name);
    // The numbers follow the order of the members, on which Fill relies.
    field->set_number(++number);
    field->set_type(FieldType(member));
    field->set_label(IsRepeated(member) ? pb::FieldDescriptorProto::LABEL_REPEATED
                                        : pb::FieldDescriptorProto::LABEL_OPTIONAL);
    if (field->type() != pb::FieldDescriptorProto::TYPE_MESSAGE) continue;
    // A dot before it makes the name a full one, which is not looked for in the packages around.
    field->set_type_name("." + member.type);
    // A type of another package is in another file, which is imported once.
    const std::string import = FileOf(PackageOf(member.type));
    const auto& imports = file->dependency();
    const bool known = std::find(imports.begin(), imports.end(), import) != imports.end();
    if (import != file->name() && !known) file->add_dependency(import);
  }
}

/// All that defines the type: a file a package.
pb::FileDescriptorSet DefineAll(const LcmSchema& schema, const LcmType& type) {
  std::set<std::string> names;
  CollectTypes(schema, type, &names);
  pb::FileDescriptorSet set;
  std::map<std::string, pb::FileDescriptorProto*> files;
  // Names are sorted, so that equal types give equal bytes.
  for (const std::string& name : names) {
    pb::FileDescriptorProto*& file = files[PackageOf(name)];
    if (file == nullptr) {
      file = set.add_file();
      file->set_name(FileOf(PackageOf(name)));
      file->set_package(PackageOf(name));
      file->set_syntax("proto3");
    }
    Define(*schema.FindByName(name), file);
  }
  return set;
}

/// What hexadecimal digits stand for.
std::string FromHex(const std::string& digits) {
  std::string bytes;
  // The decoder writes small letters, two digits a byte.
  const auto value = [](char c) { return c <= '9' ? c - '0' : c - 'a' + 10; };
  for (size_t i = 0; i + 1 < digits.size(); i += 2) {
    bytes += static_cast<char>(value(digits[i]) * 16 + value(digits[i + 1]));
  }
  return bytes;
}

/// Text as UTF-8: writing it as JSON replaces what is none.
std::string AsUtf8(const std::string& text) {
  return LcmJson::parse(JsonText(LcmJson(text))).get<std::string>();
}

void Fill(const LcmJson& message, pb::Message* out);

/// Sets a field that is no list, or appends one value to a list.
void SetOrAdd(const LcmJson& value, const pb::FieldDescriptor* field, pb::Message* out) {
  const pb::Reflection* r = out->GetReflection();
  // LcmSchema::Decode has made the values, each of its member's type, so that no get here throws.
  const bool list = field->is_repeated();
  switch (field->type()) {
    case pb::FieldDescriptor::TYPE_SINT32: {
      const auto number = value.get<int32_t>();
      return list ? r->AddInt32(out, field, number) : r->SetInt32(out, field, number);
    }
    case pb::FieldDescriptor::TYPE_SINT64: {
      const auto number = value.get<int64_t>();
      return list ? r->AddInt64(out, field, number) : r->SetInt64(out, field, number);
    }
    case pb::FieldDescriptor::TYPE_UINT32: {
      const auto number = value.get<uint32_t>();
      return list ? r->AddUInt32(out, field, number) : r->SetUInt32(out, field, number);
    }
    case pb::FieldDescriptor::TYPE_BOOL: {
      const bool truth = value.get<bool>();
      return list ? r->AddBool(out, field, truth) : r->SetBool(out, field, truth);
    }
    case pb::FieldDescriptor::TYPE_FLOAT: {
      // A float that was widened for JSON becomes the same float again.
      const auto number = static_cast<float>(value.get<double>());
      return list ? r->AddFloat(out, field, number) : r->SetFloat(out, field, number);
    }
    case pb::FieldDescriptor::TYPE_DOUBLE: {
      const auto number = value.get<double>();
      return list ? r->AddDouble(out, field, number) : r->SetDouble(out, field, number);
    }
    case pb::FieldDescriptor::TYPE_MESSAGE:
      return Fill(value, list ? r->AddMessage(out, field) : r->MutableMessage(out, field));
    // Text and bytes, both of which are text in JSON.
    default: {
      const auto& text = value.get_ref<const std::string&>();
      const bool bytes = field->type() == pb::FieldDescriptor::TYPE_BYTES;
      std::string set = bytes ? FromHex(text) : AsUtf8(text);
      return list ? r->AddString(out, field, std::move(set))
                  : r->SetString(out, field, std::move(set));
    }
  }
}

/// The values of a field in the order of the wire, however many dimensions it has.
void SetAll(const LcmJson& value, const pb::FieldDescriptor* field, pb::Message* out) {
  if (!value.is_array()) return SetOrAdd(value, field, out);
  for (const LcmJson& element : value) SetAll(element, field, out);
}

/// Sets every field; members and fields have the same order.
void Fill(const LcmJson& message, pb::Message* out) {
  int index = 0;
  for (const auto& [name, value] : message.items()) {
    SetAll(value, out->GetDescriptor()->field(index++), out);
  }
}

}  // namespace

LcmProto::LcmProto() : parts_(std::make_unique<Parts>()) {}
LcmProto::~LcmProto() = default;

Result<std::unique_ptr<LcmProto>> LcmProto::Create(const LcmSchema& schema, const LcmType& type) {
  const pb::LogSilencer silencer;  // We say ourselves what is wrong.
  std::unique_ptr<LcmProto> proto(new LcmProto());
  pb::FileDescriptorSet set = DefineAll(schema, type);
  // A file can be built once those that it imports are: in rounds, until none is left or none fits.
  Parts& parts = *proto->parts_;
  for (int round = 0; round < set.file_size(); ++round) {
    for (const pb::FileDescriptorProto& file : set.file()) {
      const auto& imports = file.dependency();
      const bool ready = std::all_of(imports.begin(), imports.end(), [&](const std::string& name) {
        return parts.pool.FindFileByName(name) != nullptr;
      });
      if (ready && parts.pool.FindFileByName(file.name()) == nullptr) parts.pool.BuildFile(file);
    }
  }
  const pb::Descriptor* descriptor = parts.pool.FindMessageTypeByName(type.name);
  if (descriptor == nullptr) {
    return Fail("Protocol Buffers cannot express the type " + type.name);
  }
  parts.prototype = parts.factory.GetPrototype(descriptor);
  proto->schema_ = set.SerializeAsString();
  return proto;
}

std::string LcmProto::Convert(const nlohmann::ordered_json& message) const {
  const std::unique_ptr<pb::Message> out(parts_->prototype->New());
  Fill(message, out.get());
  return out->SerializeAsString();
}

}  // namespace morphbus::tools
