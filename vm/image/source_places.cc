#include "vm/image/source_places.h"

#include "vm/image/image_texts.h"

namespace morphbus::vm {

std::string PlaceText(const SourcePlace& place) {
  return (place.file.empty() ? "line " : place.file + ":") + std::to_string(place.line);
}

SourceFiles::SourceFiles(const VerifiedProgram& program) : own_(ToString(program.source_name())) {
  for (int i = 0; i < program.num_imported_files(); ++i) {
    const ImportedFile file = program.imported_file(i);
    imported_.emplace_back(file.first_line, ToString(file.name));
  }
}

SourcePlace SourceFiles::Of(int line, const std::string& called) const {
  // The last file that begins at or before the line; the program's own begins with line 1.
  const std::pair<int, std::string>* of = nullptr;
  for (const auto& file : imported_) {
    if (file.first <= line) of = &file;
  }
  if (of == nullptr) return {called.empty() ? own_ : called, line};
  // An image may lie elsewhere than what it was compiled from.
  const size_t folder = called.find_last_of('/') + 1;
  const bool is_own = called.substr(folder) == own_;
  return {(is_own && !of->second.starts_with('/') ? called.substr(0, folder) : "") + of->second,
          line - of->first + 1};
}

int SourceFiles::LineOfAll(const SourcePlace& place) const {
  const auto is = [&place](const std::string& file) {
    return file == place.file || file.ends_with("/" + place.file) ||
           place.file.ends_with("/" + file);
  };
  if (place.file.empty() || is(own_)) return place.line;
  for (const auto& [first, file] : imported_) {
    if (is(file)) return first + place.line - 1;
  }
  return 0;
}

}  // namespace morphbus::vm
