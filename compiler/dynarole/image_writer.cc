#include "compiler/dynarole/image_writer.h"

#include <algorithm>
#include <map>

#include "vm/image/image.h"

namespace morphbus::dynarole {

namespace {

using vm::image::Section;

// Little-endian bytes, as the virtual machine reads them.
class Bytes {
 public:
  /// One byte, from a number or an enumerator.
  template <typename T>
  void U8(T value) {
    bytes_.push_back(static_cast<uint8_t>(value));
  }
  /// Numbers are little-endian in an image, as the virtual machine reads them.
  void U16(size_t value) {
    U8(value & 255);
    U8(value >> 8 & 255);
  }
  void U32(size_t value) {
    U16(value & 0xffff);
    U16(value >> 16 & 0xffff);
  }
  void Append(const std::vector<uint8_t>& other) {
    bytes_.insert(bytes_.end(), other.begin(), other.end());
  }
  [[nodiscard]] const std::vector<uint8_t>& bytes() const { return bytes_; }
  [[nodiscard]] size_t size() const { return bytes_.size(); }

 private:
  std::vector<uint8_t> bytes_;
};

// Fills the sections one by one, then puts them together behind the header.
class Writer {
 public:
  Writer(const keywords::KeywordTable& keywords, const ProgramModel& model, const ProgramCode& code)
      : keywords_(keywords), model_(model), code_(code) {}

  /// The whole image, with the name of its source for messages of faults.
  std::vector<uint8_t> Write(const std::string& source_name) {
    // The sizes and the hash are known at the end only, and are patched in then.
    Bytes header;
    header.U32(vm::image::kMagic);
    header.U16(vm::image::kVersion);
    header.U16(vm::image::kDefaultSettleTicks);
    header.U32(0);  // Size, below.
    header.U32(vm::image::kDefaultBudget);
    header.U32(0);  // Hash, below.
    header.U32(0);
    Text(&header, source_name);
    WriteKeywords();
    WriteConstants();
    WriteFunctions();
    for (const RoleModel& role : model_.roles) WriteRole(role);
    // The texts are collected while the other sections are written.
    section(Section::kStrings) = strings_;
    return Assemble(&header);
  }

 private:
  // Sections in the order of vm::image::Section, which is also their order in the image.
  Bytes& section(Section which) { return sections_[static_cast<int>(which)]; }

  // Equal texts are stored once.
  void Text(Bytes* out, const std::string& text) {
    const auto [it, is_new] = offsets_.emplace(text, strings_.size());
    if (is_new) {
      for (const char c : text) strings_.U8(static_cast<uint8_t>(c));
    }
    out->U16(it->second);
    out->U16(text.size());
  }

  void WriteKeywords() {
    // Keywords are stored by name, and each module binds them to its own parts.
    for (const int index : model_.keywords) {
      const keywords::Keyword& keyword = keywords_.all()[index];
      section(Section::kKeywords).U8(keyword.kind);
      Text(&section(Section::kKeywords), keyword.name);
    }
  }

  // A constant is its type and its 32 bits.
  void WriteConstants() {
    for (const auto& [type, bits] : code_.constants) {
      section(Section::kConstants).U8(type);
      section(Section::kConstants).U32(bits);
    }
  }

  void WriteFunctions() {
    for (size_t i = 0; i < model_.routines.size(); ++i) {
      // The record of a function; its code, joins and lines stand in sections of their own.
      const Routine& routine = model_.routines[i];
      const FunctionCode& function = code_.functions[i];
      Bytes& out = section(Section::kFunctions);
      Text(&out, routine.name);
      out.U8(routine.role);
      out.U8(ValueTypeOf(routine.result));
      out.U8(routine.member->parameters.size());
      out.U8(routine.locals.size());
      // Places in the sections of code and joins are where the next entry goes.
      out.U32(section(Section::kCode).size());
      out.U32(function.bytes.size());
      out.U16(num_joins_);
      out.U16(function.joins.size());
      // The types of all locals, in a record of fixed size.
      for (size_t k = 0; k < vm::image::kMaxLocals; ++k) {
        out.U8(k < routine.locals.size() ? ValueTypeOf(routine.locals[k]) : vm::ValueType::kVoid);
      }
      for (const JoinCode& join : function.joins) {
        section(Section::kJoins).U16(join.offset);
        section(Section::kJoins).U16(join.set_locals);
        section(Section::kJoins).U32(join.stack_types);
      }
      num_joins_ += function.joins.size();
      for (const LineCode& line : function.lines) {
        // A function counts its lines from its own beginning, the image from that of all code.
        section(Section::kLines).U32(section(Section::kCode).size() + line.offset);
        section(Section::kLines).U16(line.line);
      }
      section(Section::kCode).Append(function.bytes);
    }
  }

  void WriteRole(const RoleModel& role) {
    // First how many of each kind of member, then the members, so that a reader knows the size.
    Bytes& out = section(Section::kRoles);
    Text(&out, role.name);
    out.U16(role.parent < 0 ? 0xffff : role.parent);
    out.U8(role.role->abstract_role ? 1 : 0);
    out.U8(role.depth);
    for (const size_t size :
         {role.fields.size(), role.labels.size(), role.requirements.size(), role.startups.size(),
          role.behaviors.size(), role.commands.size(), role.handlers.size(), role.methods.size()}) {
      out.U8(size);
    }
    // Each table in the order of its slots, which the code refers to.
    for (const FieldSlot& slot : role.fields) {
      const FieldDecl& decl = model_.fields[slot.decl];
      Text(&out, decl.name);
      out.U8(ValueTypeOf(decl.type));
      out.U32(slot.cell.bits);
    }
    for (const NamedSlot& label : role.labels) {
      Text(&out, label.name);
      out.U8(ValueTypeOf(model_.routines[label.routine].result));
      out.U16(label.routine);
    }
    for (const int requirement : role.requirements) out.U16(requirement);
    for (const auto* slots : {&role.startups, &role.behaviors, &role.commands}) {
      for (const NamedSlot& slot : *slots) {
        Text(&out, slot.name);
        out.U16(slot.routine);
      }
    }
    for (const NamedSlot& handler : role.handlers) {
      // BuildModel has accepted no other names.
      out.U8(std::ranges::find(kEventNames, handler.name) - std::begin(kEventNames));
      out.U16(handler.routine);
    }
    for (const NamedSlot& method : role.methods) out.U16(method.routine);
  }

  std::vector<uint8_t> Assemble(Bytes* header) {
    // The header ends with the place and count of each section.
    size_t begin = vm::image::kHeaderBytes;
    for (int i = 0; i < vm::image::kNumSections; ++i) {
      header->U32(begin);
      header->U32(CountOf(static_cast<Section>(i)));
      begin += sections_[i].size();
    }
    if (begin > vm::kMaxImageBytes) return {};
    Bytes image = *header;
    for (const Bytes& part : sections_) image.Append(part.bytes());
    std::vector<uint8_t> bytes = image.bytes();
    // The hash covers all bytes but its own, so it comes last.
    const auto patch = [&bytes](size_t at, uint64_t value, size_t count) {
      for (size_t i = 0; i < count; ++i) bytes[at + i] = static_cast<uint8_t>(value >> (8 * i));
    };
    patch(vm::image::kSizeAt, bytes.size(), 4);
    patch(vm::image::kHashAt, vm::image::HashOf(bytes.data(), static_cast<uint32_t>(bytes.size())),
          8);
    return bytes;
  }

  // Records of a section, or its bytes where it has no records of one size.
  size_t CountOf(Section which) {
    switch (which) {
      case Section::kKeywords:
        return model_.keywords.size();
      case Section::kConstants:
        return code_.constants.size();
      case Section::kFunctions:
        return model_.routines.size();
      case Section::kRoles:
        return model_.roles.size();
      case Section::kJoins:
        return num_joins_;
      case Section::kLines:
        return section(which).size() / vm::image::kLineBytes;
      default:
        return section(which).size();
    }
  }

  const keywords::KeywordTable& keywords_;
  const ProgramModel& model_;
  const ProgramCode& code_;
  Bytes sections_[vm::image::kNumSections];
  Bytes strings_;
  // Where each text begins in the section of strings.
  std::map<std::string, size_t> offsets_;
  size_t num_joins_ = 0;
};

}  // namespace

std::vector<uint8_t> WriteImage(const std::string& source_name,
                                const keywords::KeywordTable& keywords, const ProgramModel& model,
                                const ProgramCode& code) {
  // Control characters in a file's name would reach terminals through faults and listings.
  std::string name = source_name.substr(source_name.find_last_of('/') + 1);
  if (name.size() > 255) name.resize(255);
  for (char& c : name) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  return Writer(keywords, model, code).Write(name);
}

}  // namespace morphbus::dynarole
