#include "compiler/dynarole/image_writer.h"

#include <map>

#include "vm/image.h"

namespace morphbus::dynarole {

namespace {

using vm::image::Section;

class Bytes {
 public:
  void U8(size_t value) { bytes_.push_back(static_cast<uint8_t>(value)); }
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

class Writer {
 public:
  Writer(const KeywordTable& keywords, const ProgramModel& model, const ProgramCode& code)
      : keywords_(keywords), model_(model), code_(code) {}

  std::vector<uint8_t> Write(const std::string& source_name) {
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
    section(Section::kStrings) = strings_;
    return Assemble(&header);
  }

 private:
  Bytes& section(Section which) { return sections_[static_cast<size_t>(which)]; }

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
    for (const int index : model_.keywords) {
      const Keyword& keyword = keywords_.all()[static_cast<size_t>(index)];
      section(Section::kKeywords).U8(static_cast<size_t>(keyword.kind));
      Text(&section(Section::kKeywords), keyword.name);
    }
  }

  void WriteConstants() {
    for (const auto& [type, bits] : code_.constants) {
      section(Section::kConstants).U8(static_cast<size_t>(type));
      section(Section::kConstants).U32(bits);
    }
  }

  void WriteFunctions() {
    for (size_t i = 0; i < model_.routines.size(); ++i) {
      const Routine& routine = model_.routines[i];
      const FunctionCode& function = code_.functions[i];
      Bytes& out = section(Section::kFunctions);
      Text(&out, routine.name);
      out.U8(static_cast<size_t>(routine.role));
      out.U8(static_cast<size_t>(ValueTypeOf(routine.result)));
      out.U8(routine.member->parameters.size());
      out.U8(routine.locals.size());
      out.U32(section(Section::kCode).size());
      out.U32(function.bytes.size());
      out.U16(num_joins_);
      out.U16(function.joins.size());
      for (size_t k = 0; k < vm::image::kMaxLocals; ++k) {
        out.U8(k < routine.locals.size() ? static_cast<size_t>(ValueTypeOf(routine.locals[k])) : 0);
      }
      for (const JoinCode& join : function.joins) {
        section(Section::kJoins).U16(join.offset);
        section(Section::kJoins).U16(join.set_locals);
        section(Section::kJoins).U32(join.stack_types);
      }
      num_joins_ += function.joins.size();
      for (const LineCode& line : function.lines) {
        section(Section::kLines).U32(section(Section::kCode).size() + line.offset);
        section(Section::kLines).U16(line.line);
      }
      section(Section::kCode).Append(function.bytes);
    }
  }

  void WriteRole(const RoleModel& role) {
    Bytes& out = section(Section::kRoles);
    Text(&out, role.name);
    out.U16(static_cast<size_t>(role.parent < 0 ? 0xffff : role.parent));
    out.U8(role.role->abstract_role ? 1 : 0);
    out.U8(static_cast<size_t>(role.depth));
    out.U8(role.fields.size());
    out.U8(role.labels.size());
    out.U8(role.requirements.size());
    out.U8(role.startups.size());
    out.U8(role.behaviors.size());
    out.U8(role.commands.size());
    out.U8(role.handlers.size());
    out.U8(role.methods.size());
    for (const FieldSlot& slot : role.fields) {
      const FieldDecl& decl = model_.fields[static_cast<size_t>(slot.decl)];
      Text(&out, decl.name);
      out.U8(static_cast<size_t>(ValueTypeOf(decl.type)));
      out.U32(slot.cell.bits);
    }
    for (const NamedSlot& label : role.labels) {
      Text(&out, label.name);
      out.U8(static_cast<size_t>(
          ValueTypeOf(model_.routines[static_cast<size_t>(label.routine)].result)));
      out.U16(static_cast<size_t>(label.routine));
    }
    for (const int requirement : role.requirements) out.U16(static_cast<size_t>(requirement));
    for (const auto* slots : {&role.startups, &role.behaviors, &role.commands}) {
      for (const NamedSlot& slot : *slots) {
        Text(&out, slot.name);
        out.U16(static_cast<size_t>(slot.routine));
      }
    }
    for (const NamedSlot& handler : role.handlers) {
      out.U8(static_cast<size_t>(EventOf(handler.name)));
      out.U16(static_cast<size_t>(handler.routine));
    }
    for (const NamedSlot& method : role.methods) out.U16(static_cast<size_t>(method.routine));
  }

  static vm::Event EventOf(const std::string& name) {
    if (name == "on_connect") return vm::Event::kConnect;
    if (name == "on_disconnect") return vm::Event::kDisconnect;
    return name == "on_stall" ? vm::Event::kStall : vm::Event::kTimer;
  }

  std::vector<uint8_t> Assemble(Bytes* header) {
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
    const auto patch = [&bytes](size_t at, uint64_t value, size_t count) {
      for (size_t i = 0; i < count; ++i) bytes[at + i] = static_cast<uint8_t>(value >> (8 * i));
    };
    patch(vm::image::kSizeAt, bytes.size(), 4);
    patch(vm::image::kHashAt, vm::image::HashOf(bytes.data(), static_cast<uint32_t>(bytes.size())),
          8);
    return bytes;
  }

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

  const KeywordTable& keywords_;
  const ProgramModel& model_;
  const ProgramCode& code_;
  Bytes sections_[vm::image::kNumSections];
  Bytes strings_;
  std::map<std::string, size_t> offsets_;
  size_t num_joins_ = 0;
};

}  // namespace

std::vector<uint8_t> WriteImage(const std::string& source_name, const KeywordTable& keywords,
                                const ProgramModel& model, const ProgramCode& code) {
  std::string name = source_name.substr(source_name.find_last_of('/') + 1);
  if (name.size() > 255) name.resize(255);
  for (char& c : name) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  return Writer(keywords, model, code).Write(name);
}

}  // namespace morphbus::dynarole
