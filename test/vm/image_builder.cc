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
    vm::Put(out, text.size(), 1);
    bytes.insert(bytes.end(), text.begin(), text.end());
  }
};

struct Tables {
  Strings strings, note_strings;
  std::vector<uint8_t> keywords, constants, types, functions, roles, states, joins, code;
  std::vector<uint8_t> names, field_names, local_names, lines;
  size_t num_constants = 0, num_joins = 0;
};

void PutConstant(ValueType type, uint32_t bits, Tables* tables) {
  Put(&tables->constants, static_cast<uint64_t>(type), 1);
  Put(&tables->constants, bits, 4);
  ++tables->num_constants;
}

void PutRole(const TestRole& role, Tables* tables) {
  std::vector<uint8_t>* out = &tables->roles;
  tables->strings.Put(out, role.name);
  Put(out, static_cast<uint8_t>(role.parent), 1);
  Put(out, static_cast<uint64_t>(role.depth) | (role.abstract_role ? 0x80 : 0), 1);
  for (const size_t count :
       {role.fields.size(), role.labels.size(), role.requirements.size(), role.startups.size(),
        role.behaviors.size(), role.commands.size(), role.handlers.size(), role.methods.size()}) {
    Put(out, count, 1);
  }
  // Each field has a constant of its own, behind those that the test gave.
  for (const TestField& field : role.fields) {
    const auto type = static_cast<int>(field.type);
    Put(out, tables->num_constants | static_cast<uint64_t>(type & 0x80) << 8, 2);
    PutConstant(static_cast<ValueType>(type & 0x7f), field.bits, tables);
    tables->note_strings.Put(&tables->field_names, "field");
  }
  for (const auto& label : role.labels) Put(out, static_cast<uint64_t>(label.second), 2);
  for (const auto* functions :
       {&role.requirements, &role.startups, &role.behaviors, &role.commands}) {
    for (const int function : *functions) Put(out, static_cast<uint64_t>(function), 2);
  }
  for (const auto& [event, function] : role.handlers) {
    Put(out, static_cast<uint64_t>(event), 1);
    Put(out, static_cast<uint64_t>(function), 2);
  }
  for (const int function : role.methods) Put(out, static_cast<uint64_t>(function), 2);
}

void PutFunction(const TestFunction& function, Tables* tables) {
  std::vector<uint8_t>& out = tables->functions;
  Put(&out, tables->code.size(), 2);
  Put(&out, static_cast<uint64_t>(function.role), 1);
  Put(&out,
      static_cast<uint64_t>(function.return_type) |
          static_cast<uint64_t>(function.num_arguments) << 4 | function.locals.size() << 9,
      2);
  Put(&out, tables->types.size(), 2);
  for (size_t i = 0; i < function.locals.size(); ++i) {
    Put(&tables->types, static_cast<uint64_t>(function.locals[i]), 1);
    tables->note_strings.Put(&tables->local_names, "local_" + std::to_string(i));
  }
  tables->note_strings.Put(&tables->names, function.name);
  // Each join has a state of its own.
  for (const TestJoin& join : function.joins) {
    Put(&tables->joins, tables->code.size() + static_cast<size_t>(join.offset), 2);
    Put(&tables->joins, tables->num_joins, 2);
    Put(&tables->states, static_cast<uint64_t>(join.set_locals), 2);
    uint32_t types = 0;
    for (size_t i = 0; i < join.stack.size(); ++i) {
      types |= static_cast<uint32_t>(join.stack[i]) << (4 * i);
    }
    Put(&tables->states, types, 4);
    ++tables->num_joins;
  }
  tables->code.insert(tables->code.end(), function.code.begin(), function.code.end());
}

/// Names and lines.
std::vector<uint8_t> NotesOf(const TestImage& image, Tables* tables) {
  std::vector<uint8_t> source;
  tables->note_strings.Put(&source, image.source_name);
  for (const auto& [offset, line] : image.lines) {
    Put(&tables->lines, static_cast<uint64_t>(offset), 2);
    Put(&tables->lines, static_cast<uint64_t>(line), 2);
  }
  std::vector<uint8_t> notes;
  Put(&notes, 0x534e5944, 4);
  Put(&notes, tables->note_strings.bytes.size(), 2);
  Put(&notes, tables->field_names.size() / 3, 2);
  Put(&notes, tables->local_names.size() / 3, 2);
  Put(&notes, image.lines.size(), 2);
  for (const auto* part : {&source, &tables->note_strings.bytes, &tables->names,
                           &tables->field_names, &tables->local_names, &tables->lines}) {
    notes.insert(notes.end(), part->begin(), part->end());
  }
  return notes;
}

/// FNV-1a-64, written out again here; the eight bytes from `skip` on are left out.
uint64_t Fnv(const std::vector<uint8_t>& bytes, size_t begin, size_t end, size_t skip) {
  uint64_t hash = 14695981039346656037ULL;
  for (size_t i = begin; i < end; ++i) {
    if (i >= skip && i < skip + 8) continue;
    hash ^= bytes[i];
    hash *= 1099511628211ULL;
  }
  return hash;
}

void Patch(std::vector<uint8_t>* image, size_t at, uint64_t value, size_t bytes) {
  for (size_t i = 0; i < bytes && at + i < image->size(); ++i) {
    (*image)[at + i] = static_cast<uint8_t>(value >> (8 * i));
  }
}

}  // namespace

std::vector<uint8_t> TestImage::Build() const {
  Tables tables;
  std::vector<uint8_t> image;
  Put(&image, 0x494e5944, 4);
  Put(&image, 3, 2);
  Put(&image, 10, 2);
  Put(&image, 0, 4);
  Put(&image, budget, 4);
  Put(&image, 0, 8);
  Put(&image, 0, 8);
  for (const auto& [kind, name] : keywords) {
    Put(&tables.keywords, static_cast<uint64_t>(kind), 1);
    tables.strings.Put(&tables.keywords, name);
  }
  for (const auto& [type, bits] : constants) PutConstant(type, bits, &tables);
  for (const TestFunction& function : functions) PutFunction(function, &tables);
  for (const TestRole& role : roles) PutRole(role, &tables);
  const std::vector<uint8_t> notes = NotesOf(*this, &tables);
  const std::pair<const std::vector<uint8_t>*, size_t> sections[] = {
      {&tables.strings.bytes, tables.strings.bytes.size()},
      {&tables.keywords, keywords.size()},
      {&tables.constants, tables.num_constants},
      {&tables.types, tables.types.size()},
      {&tables.functions, functions.size()},
      {&tables.roles, roles.size()},
      {&tables.states, tables.num_joins},
      {&tables.joins, tables.num_joins},
      {&tables.code, tables.code.size()}};
  for (const auto& section : sections) Put(&image, section.second, 2);
  for (const auto& section : sections) {
    image.insert(image.end(), section.first->begin(), section.first->end());
  }
  Patch(&image, 8, image.size(), 4);
  image.insert(image.end(), notes.begin(), notes.end());
  Rehash(&image);
  return image;
}

void Rehash(std::vector<uint8_t>* image) {
  // A test may have broken the size: then all counts as the part that runs.
  size_t run = image->size();
  if (image->size() >= 12) {
    const size_t said = (*image)[8] | (*image)[9] << 8 | (*image)[10] << 16;
    if (said < run && (*image)[11] == 0) run = said;
  }
  if (run < image->size()) Patch(image, 24, Fnv(*image, run, image->size(), image->size()), 8);
  Patch(image, 16, Fnv(*image, 0, run, 16), 8);
}

TestImage WithMethod(const Code& startup, TestFunction method) {
  TestImage image(startup);
  method.name = "R.f";
  image.functions.push_back(std::move(method));
  image.roles[0].methods = {1};
  return image;
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
