#include "test/vm/image_builder.h"

#include <cstring>
#include <memory>

#include "vm/image/image.h"
#include "vm/image/verifier.h"

namespace morphbus::vm {

namespace {

void Put(std::vector<uint8_t>* out, uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out->push_back(static_cast<uint8_t>(value >> (8 * i)));
}

struct Strings {
  std::vector<uint8_t> bytes;
  void Put(std::vector<uint8_t>* out, const std::string& text) {
    vm::Put(out, bytes.size(), 2);
    vm::Put(out, text.size(), 2);
    bytes.insert(bytes.end(), text.begin(), text.end());
  }
};

void PutRole(const TestRole& role, Strings* strings, std::vector<uint8_t>* out) {
  strings->Put(out, role.name);
  Put(out, static_cast<uint16_t>(role.parent), 2);
  Put(out, role.abstract_role ? 1 : 0, 1);
  Put(out, static_cast<uint64_t>(role.depth), 1);
  for (const size_t count :
       {role.fields.size(), role.labels.size(), role.requirements.size(), role.startups.size(),
        role.behaviors.size(), role.commands.size(), role.handlers.size(), role.methods.size()}) {
    Put(out, count, 1);
  }
  for (const TestField& field : role.fields) {
    strings->Put(out, "field");
    Put(out, static_cast<uint64_t>(field.type), 1);
    Put(out, field.bits, 4);
  }
  for (const auto& [type, function] : role.labels) {
    strings->Put(out, "label");
    Put(out, static_cast<uint64_t>(type), 1);
    Put(out, static_cast<uint64_t>(function), 2);
  }
  for (const int function : role.requirements) Put(out, static_cast<uint64_t>(function), 2);
  for (const auto* routines : {&role.startups, &role.behaviors, &role.commands}) {
    for (const int function : *routines) {
      strings->Put(out, "routine");
      Put(out, static_cast<uint64_t>(function), 2);
    }
  }
  for (const auto& [event, function] : role.handlers) {
    Put(out, static_cast<uint64_t>(event), 1);
    Put(out, static_cast<uint64_t>(function), 2);
  }
  for (const int function : role.methods) Put(out, static_cast<uint64_t>(function), 2);
}

struct Tables {
  Strings strings;
  std::vector<uint8_t> keywords, constants, functions, roles, joins, code, lines;
  size_t num_joins = 0;
};

void PutFunction(const TestFunction& function, Tables* tables) {
  std::vector<uint8_t>& out = tables->functions;
  tables->strings.Put(&out, function.name);
  Put(&out, static_cast<uint64_t>(function.role), 1);
  Put(&out, static_cast<uint64_t>(function.return_type), 1);
  Put(&out, static_cast<uint64_t>(function.num_arguments), 1);
  Put(&out, function.locals.size(), 1);
  Put(&out, tables->code.size(), 4);
  Put(&out, function.code.size(), 4);
  Put(&out, tables->num_joins, 2);
  Put(&out, function.joins.size(), 2);
  for (size_t i = 0; i < 16; ++i) {
    Put(&out, i < function.locals.size() ? static_cast<uint64_t>(function.locals[i]) : 0, 1);
  }
  for (const TestJoin& join : function.joins) {
    Put(&tables->joins, static_cast<uint64_t>(join.offset), 2);
    Put(&tables->joins, static_cast<uint64_t>(join.set_locals), 2);
    uint32_t types = 0;
    for (size_t i = 0; i < join.stack.size(); ++i) {
      types |= static_cast<uint32_t>(join.stack[i]) << (4 * i);
    }
    Put(&tables->joins, types, 4);
  }
  tables->num_joins += function.joins.size();
  tables->code.insert(tables->code.end(), function.code.begin(), function.code.end());
}

}  // namespace

std::vector<uint8_t> TestImage::Build() const {
  Tables tables;
  std::vector<uint8_t> header;
  Put(&header, 0x494e5944, 4);
  Put(&header, 1, 2);
  Put(&header, 10, 2);
  Put(&header, 0, 4);
  Put(&header, budget, 4);
  Put(&header, 0, 8);
  tables.strings.Put(&header, source_name);
  for (const auto& [kind, name] : keywords) {
    Put(&tables.keywords, static_cast<uint64_t>(kind), 1);
    tables.strings.Put(&tables.keywords, name);
  }
  for (const auto& [type, bits] : constants) {
    Put(&tables.constants, static_cast<uint64_t>(type), 1);
    Put(&tables.constants, bits, 4);
  }
  for (const TestFunction& function : functions) PutFunction(function, &tables);
  for (const TestRole& role : roles) PutRole(role, &tables.strings, &tables.roles);
  for (const auto& [offset, line] : lines) {
    Put(&tables.lines, static_cast<uint64_t>(offset), 4);
    Put(&tables.lines, static_cast<uint64_t>(line), 2);
  }
  const std::pair<const std::vector<uint8_t>*, size_t> sections[] = {
      {&tables.strings.bytes, tables.strings.bytes.size()},
      {&tables.keywords, keywords.size()},
      {&tables.constants, constants.size()},
      {&tables.functions, functions.size()},
      {&tables.roles, roles.size()},
      {&tables.joins, tables.num_joins},
      {&tables.code, tables.code.size()},
      {&tables.lines, lines.size()}};
  size_t begin = image::kHeaderBytes;
  for (const auto& [bytes, count] : sections) {
    Put(&header, begin, 4);
    Put(&header, count, 4);
    begin += bytes->size();
  }
  std::vector<uint8_t> image = header;
  for (const auto& section : sections) {
    image.insert(image.end(), section.first->begin(), section.first->end());
  }
  for (int i = 0; i < 4; ++i)
    image[8 + static_cast<size_t>(i)] = static_cast<uint8_t>(image.size() >> (8 * i));
  Rehash(&image);
  return image;
}

// FNV-1a-64, written out again here.
void Rehash(std::vector<uint8_t>* image) {
  uint64_t hash = 14695981039346656037ULL;
  for (size_t i = 0; i < image->size(); ++i) {
    if (i >= 16 && i < 24) continue;
    hash ^= (*image)[i];
    hash *= 1099511628211ULL;
  }
  for (size_t i = 0; i < 8 && 16 + i < image->size(); ++i) {
    (*image)[16 + i] = static_cast<uint8_t>(hash >> (8 * i));
  }
}

std::string VerifyMessage(const std::vector<uint8_t>& image) {
  const auto program = std::make_unique<VerifiedProgram>();
  const VerifyError error =
      Verifier::Verify(image.data(), static_cast<uint32_t>(image.size()), program.get());
  return error.message != nullptr ? error.message : "";
}

uint32_t Bits(float value) {
  uint32_t bits;
  std::memcpy(&bits, &value, 4);
  return bits;
}

}  // namespace morphbus::vm
