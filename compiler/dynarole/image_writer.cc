#include "compiler/dynarole/image_writer.h"

#include <algorithm>
#include <map>
#include <set>

#include "vm/image/image.h"
#include "vm/image/image_bytes.h"

namespace morphbus::dynarole {

namespace {

using vm::ImageBytes;
using vm::image::Section;

/// A file as the notes name it.
std::string NameInNotes(const source::SourceSet& sources, int file) {
  std::string name = sources.NameFromFirst(file);
  if (name.size() > 255) name.resize(255);
  // Control characters in a file's name would reach terminals through faults and listings.
  for (char& c : name) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  return name;
}

// Fills the sections one by one, then puts them together behind the header.
class Writer {
 public:
  Writer(const source::SourceSet& sources, const keywords::KeywordTable& keywords,
         const ProgramModel& model, const ProgramCode& code)
      : sources_(sources), keywords_(keywords), model_(model), code_(code) {}

  /// The whole image, its notes included.
  std::vector<uint8_t> Write() {
    WriteKeywords();
    constants_ = code_.constants;
    for (size_t i = 0; i < model_.routines.size(); ++i) WriteFunction(i);
    for (const RoleModel& role : model_.roles) WriteRole(role);
    // Fields have added their first values to what the code needs.
    WriteConstants();
    // What holds at joins; those where the same holds share it.
    for (const auto& [set_locals, stack_types] : states_.all()) {
      section(Section::kStates).U16(set_locals);
      section(Section::kStates).U32(stack_types);
    }
    // The texts were collected while the other sections were written.
    section(Section::kStrings) = strings_.bytes;
    return Assemble(WriteNotes());
  }

 private:
  // Texts that lie one behind the other; equal ones are stored once.
  struct Strings {
    ImageBytes bytes;
    std::map<std::string, size_t> offsets;

    size_t OffsetOf(const std::string& text) {
      // A name stands once, however many records name it.
      const auto [it, is_new] = offsets.emplace(text, bytes.size());
      if (is_new) bytes.Append(text);
      return it->second;
    }
    // A name's record; longer ones are cut, as the image has one byte for their size.
    void Put(ImageBytes* out, const std::string& text) {
      const std::string name = text.substr(0, 255);
      out->U16(OffsetOf(name));
      out->U8(name.size());
    }
  };

  // Sections in the order of vm::image::Section, which is also their order in the image.
  ImageBytes& section(Section which) { return sections_[static_cast<int>(which)]; }

  void WriteKeywords() {
    // Keywords are stored by name, and each module binds them to its own parts.
    for (const int index : model_.keywords) {
      const keywords::Keyword& keyword = keywords_.all()[index];
      section(Section::kKeywords).U8(keyword.kind);
      strings_.Put(&section(Section::kKeywords), keyword.name);
    }
  }

  // A constant is its type and its 32 bits.
  void WriteConstants() {
    for (const auto& [type, bits, parameter, kept] : constants_.all()) {
      section(Section::kConstants)
          .U8(static_cast<int>(type) | (parameter >= 0 ? vm::image::kParameterBit : 0));
      if (type == vm::ValueType::kText) {
        const std::string& text = kept >= 0 ? model_.fields[kept].name : code_.texts.all()[bits];
        section(Section::kConstants).U16(strings_.OffsetOf(text));
        section(Section::kConstants).U16(text.size());
      } else {
        section(Section::kConstants).U32(bits);
      }
    }
  }

  void WriteFunction(size_t i) {
    // The record of a function; its code, types and joins stand in sections of their own.
    const Routine& routine = model_.routines[i];
    const FunctionCode& function = code_.functions[i];
    const size_t code_begin = section(Section::kCode).size();
    ImageBytes& out = section(Section::kFunctions);
    out.U16(code_begin);
    out.U8(routine.role);
    out.U16(static_cast<size_t>(ValueTypeOf(routine.result)) |
            routine.member->parameters.size() << 4 | routine.locals.size() << 9);
    std::vector<uint8_t> types;
    for (const auto& local : routine.locals) {
      types.push_back(static_cast<uint8_t>(ValueTypeOf(local)));
    }
    out.U16(PlaceOf(types));
    // A function counts from its own beginning, the image from that of all code.
    for (const JoinCode& join : function.joins) {
      section(Section::kJoins).U16(code_begin + join.offset);
      section(Section::kJoins).U16(states_.NumberOf({join.set_locals, join.stack_types}));
      ++num_joins_;
    }
    for (const LineCode& line : function.lines) {
      lines_.U16(code_begin + line.offset);
      lines_.U16(line.line);
      with_code_.insert(line.line);
    }
    section(Section::kCode).Append(function.bytes);
  }

  // Where a list of types stands; one that stands there already serves twice.
  size_t PlaceOf(const std::vector<uint8_t>& types) {
    if (types.empty()) return 0;
    const std::vector<uint8_t>& all = section(Section::kTypes).bytes();
    const auto found = std::search(all.begin(), all.end(), types.begin(), types.end());
    const auto place = static_cast<size_t>(found - all.begin());
    if (found == all.end()) section(Section::kTypes).Append(types);
    return place;
  }

  void WriteRole(const RoleModel& role) {
    // First how many of each kind of member, then the members, so that a reader knows the size.
    ImageBytes& out = section(Section::kRoles);
    strings_.Put(&out, role.name);
    out.U8(role.parent < 0 ? int{vm::image::kNoParent} : role.parent);
    out.U8(role.depth | (role.role->abstract_role ? vm::image::kAbstractBit : 0));
    for (const size_t size :
         {role.fields.size(), role.labels.size(), role.requirements.size(), role.startups.size(),
          role.behaviors.size(), role.commands.size(), role.handlers.size(), role.methods.size()}) {
      out.U8(size);
    }
    // Each table in the order of its slots, which the code refers to.
    for (const FieldSlot& slot : role.fields) {
      const FieldDecl& decl = model_.fields[slot.decl];
      const int first = FirstValueOf(slot);
      too_large_ = too_large_ || first > vm::image::kFieldConstantMask;
      out.U16((first & vm::image::kFieldConstantMask) |
              (decl.shared ? vm::image::kSharedFieldBit : 0) |
              (decl.kept ? vm::image::kKeptFieldBit : 0) |
              (slot.traced ? vm::image::kTracedFieldBit : 0));
      field_names_.push_back(decl.name);
    }
    for (const NamedSlot& label : role.labels) out.U16(label.routine);
    for (const int requirement : role.requirements) out.U16(requirement);
    for (const auto* slots : {&role.startups, &role.behaviors, &role.commands}) {
      for (const NamedSlot& slot : *slots) out.U16(slot.routine);
    }
    for (const NamedSlot& handler : role.handlers) {
      // A timer that says its period is known by it, all others by their names.
      const int period = code_.periods[handler.routine];
      const auto event = std::ranges::find(kEventNames, handler.name) - std::begin(kEventNames);
      const bool early = model_.routines[handler.routine].member->early;
      out.U8((period >= 0 ? vm::image::kFirstPeriod + period : static_cast<int>(event)) |
             (early ? vm::image::kEarlyBit : 0));
      out.U16(handler.routine);
    }
    for (const NamedSlot& method : role.methods) out.U16(method.routine);
  }

  // The constant that a field begins with. Behind that of a kept one stands its name, by which
  // another role or program knows it.
  int FirstValueOf(const FieldSlot& slot) {
    if (slot.parameter >= 0) return constants_.NumberOf(EntryOf(model_, slot.parameter));
    const FieldDecl& decl = model_.fields[slot.decl];
    ConstantEntry entry{ValueTypeOf(decl.type), slot.cell.bits};
    if (!decl.kept) return constants_.NumberOf(entry);
    entry.kept = slot.decl;
    const int first = constants_.NumberOf(entry);
    // A subrole may begin with another value, whose name is another entry.
    constants_.NumberOf({vm::ValueType::kText, slot.cell.bits, -1, slot.decl});
    return first;
  }

  // What people want to know of the program and modules need not.
  std::vector<uint8_t> WriteNotes() {
    // The notes have strings of their own, so that modules need not hold them.
    Strings strings;
    ImageBytes source, names;
    strings.Put(&source, NameInNotes(sources_, 0));
    for (const Routine& routine : model_.routines) strings.Put(&names, routine.name);
    for (const std::string& name : field_names_) strings.Put(&names, name);
    size_t num_locals = 0;
    for (const Routine& routine : model_.routines) {
      for (const std::string& name : routine.local_names) strings.Put(&names, name);
      num_locals += routine.local_names.size();
    }
    ImageBytes ranges;
    for (const ConstantEntry& entry : constants_.all()) {
      if (entry.parameter < 0) continue;
      const ConstantModel& parameter = model_.constants[entry.parameter];
      strings.Put(&names, parameter.role < 0
                              ? parameter.name
                              : model_.roles[parameter.role].name + "." + parameter.name);
      for (const vm::Cell cell : {parameter.cell, parameter.least_cell, parameter.most_cell}) {
        ranges.U32(cell.bits);
      }
    }
    // Imported files that have code, so that of all others the image says nothing.
    ImageBytes files;
    for (int file = 1; file < sources_.size(); ++file) {
      const int first = sources_.LineOfAll(file, 0);
      const int last = sources_.LineOfAll(file, sources_.text(file).size());
      const auto with_code = with_code_.lower_bound(first);
      if (with_code == with_code_.end() || *with_code > last) continue;
      files.U16(static_cast<size_t>(first));
      strings.Put(&files, NameInNotes(sources_, file));
    }
    too_large_ = too_large_ || strings.bytes.size() > 0xffff || lines_.size() / 4 > 0xffff;
    ImageBytes notes;
    notes.U32(vm::image::kNotesMagic);
    notes.U16(strings.bytes.size());
    notes.U16(field_names_.size());
    notes.U16(num_locals);
    notes.U16(lines_.size() / vm::image::kLineBytes);
    for (const ImageBytes* part : {&source, &strings.bytes, &names, &ranges, &lines_, &files}) {
      notes.Append(part->bytes());
    }
    return notes.bytes();
  }

  std::vector<uint8_t> Assemble(const std::vector<uint8_t>& notes) {
    // The sizes and the hash are known at the end only, and are patched in then.
    ImageBytes image;
    image.U32(vm::image::kMagic);
    image.U16(vm::image::kVersion);
    image.U16(vm::image::kDefaultSettleTicks);
    image.U32(0);  // Size, below.
    image.U32(vm::image::kDefaultBudget);
    image.U64(0);  // Hash, below.
    image.U64(vm::image::HashOfNotes(notes.data(), static_cast<uint32_t>(notes.size())));
    for (int i = 0; i < vm::image::kNumSections; ++i) {
      const size_t count = CountOf(static_cast<Section>(i));
      too_large_ = too_large_ || count > 0xffff;
      image.U16(count);
    }
    for (const ImageBytes& part : sections_) image.Append(part.bytes());
    if (too_large_ || image.size() + notes.size() > vm::kMaxImageBytes) return {};
    // The hash covers all bytes but its own, so it comes last.
    image.Patch(vm::image::kSizeAt, image.size(), 4);
    image.Patch(vm::image::kHashAt,
                vm::image::HashOf(image.bytes().data(), static_cast<uint32_t>(image.size())), 8);
    image.Append(notes);
    return image.bytes();
  }

  // Records of a section, or its bytes where it has no records of one size.
  size_t CountOf(Section which) {
    switch (which) {
      case Section::kKeywords:
        return model_.keywords.size();
      case Section::kConstants:
        return constants_.all().size();
      case Section::kFunctions:
        return model_.routines.size();
      case Section::kRoles:
        return model_.roles.size();
      case Section::kStates:
        return states_.all().size();
      case Section::kJoins:
        return num_joins_;
      default:
        return section(which).size();
    }
  }

  const source::SourceSet& sources_;
  const keywords::KeywordTable& keywords_;
  const ProgramModel& model_;
  const ProgramCode& code_;
  ImageBytes sections_[vm::image::kNumSections];
  Strings strings_;
  /// Those of the code, and what fields begin with.
  Numbered<ConstantEntry> constants_;
  /// The states of joins: the locals that are set, and the types on the stack.
  Numbered<std::pair<uint16_t, uint32_t>> states_;
  size_t num_joins_ = 0;
  // For the notes.
  std::vector<std::string> field_names_;
  ImageBytes lines_;
  std::set<int> with_code_;  ///< Lines that have code, counted over all files.
  /// True if a count does not fit the header.
  bool too_large_ = false;
};

}  // namespace

std::vector<uint8_t> WriteImage(const source::SourceSet& sources,
                                const keywords::KeywordTable& keywords, const ProgramModel& model,
                                const ProgramCode& code) {
  return Writer(sources, keywords, model, code).Write();
}

}  // namespace morphbus::dynarole
