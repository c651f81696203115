#pragma once
// The compiler of DynaRole, the language of roles (docs/dynarole.md), and programs.
//
// Library morphbus-dynarole. Programs are immutable and small: copies share what they refer to, and
// any number of threads may use them at once.

#include <morphbus/diagnostic.h>
#include <morphbus/model/model.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace morphbus {

/// A parameter of a program: `param swing = 30 in [0, 60];`.
struct Parameter {
  /// With its role's name before it if it stands in one: "Leg.swing".
  std::string name;
  /// Whether its values are whole numbers; else they are floats of single precision.
  bool is_int = false;
  /// Its value in this program, and in the source. Their unit is the program's.
  double value = 0;
  double source_value = 0;
  /// The ends of its range, both allowed.
  double least = 0;
  double most = 0;
};

/// A role of a program.
struct Role {
  std::string name;
  /// The role that it extends; empty where it extends none.
  std::string extends;
  /// True if no module plays it itself.
  bool is_abstract = false;
};

/// A program that the verifier has passed: what a module can run.
class MORPHBUS_EXPORT Program {
 public:
  /// Reads an image, such as `morphbus compile` writes. Throws Failure where it is damaged, with
  /// the byte; it may come from anywhere.
  static Program FromImage(std::string_view image);
  /// The image.
  [[nodiscard]] const std::string& image() const;
  /// The hash in its header, by which the members of a run know that they run the same program.
  [[nodiscard]] uint64_t hash() const;

  /// Its roles; one that extends another stands behind it.
  [[nodiscard]] std::vector<Role> Roles() const;
  /// Its parameters, in the order of the source; an image without notes has none.
  [[nodiscard]] std::vector<Parameter> Parameters() const;
  /// The program with another value of a parameter. The role may be left out of the name where only
  /// one parameter is so called. Throws Failure for another name, or a value out of its range.
  [[nodiscard]] Program With(std::string_view parameter, double value) const;
  /// Its instructions and tables as text, as `morphbus disasm` prints them.
  [[nodiscard]] std::string Disassemble() const;

  /// For the other libraries of Morphbus: what is inside.
  class Content;
  explicit Program(std::shared_ptr<const Content> content);
  [[nodiscard]] const std::shared_ptr<const Content>& content() const { return content_; }

 private:
  std::shared_ptr<const Content> content_;
};

/// Compiles a file against the keywords of all module types of a model, or takes an image as it is.
/// Throws TextError where the text has errors, and Failure where the file cannot be read or the
/// image is damaged.
/// @param warnings  if not null, gets the warnings of a text without errors.
MORPHBUS_EXPORT Program CompileDynaRole(const std::string& path, const Model& model,
                                        std::vector<Diagnostic>* warnings = nullptr);
/// The same for a text in memory. `name` stands for the file's name in diagnostics, and for where
/// it lies: what the text imports is read from the disk, relative to the folder of that name.
MORPHBUS_EXPORT Program CompileDynaRoleText(const std::string& name, const std::string& text,
                                            const Model& model,
                                            std::vector<Diagnostic>* warnings = nullptr);
/// The text in canonical layout, as `morphbus format` writes it. Throws TextError where it does not
/// parse.
MORPHBUS_EXPORT std::string FormatDynaRole(const std::string& name, const std::string& text);

}  // namespace morphbus
