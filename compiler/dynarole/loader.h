#pragma once
// A program's file and what it imports, lexed and parsed: the first stages of the compiler
// (compile.cc makes one loader for each compilation).

#include "compiler/dynarole/ast.h"
#include "compiler/dynarole/compile.h"
#include "compiler/source/import_reader.h"

namespace morphbus::dynarole {

/// Reads each file once and puts what the files declare into one program, imported files before
/// those that import them.
class Loader : public source::ImportReader {
 public:
  /// Sources, diagnostics and the text of stage `dump` go into `result`, which outlives the loader.
  Loader(source::TextReader read, Dump dump, CompileResult* result)
      : ImportReader(std::move(read), &result->sources, &result->diagnostics),
        dump_(dump),
        result_(*result) {}

  /// Hands out the program; functions of imported files that nothing names are left out.
  Program Take();

 private:
  void Parse(int file) override;
  bool Accepts(const std::string& text, const source::Span& import) override;
  /// Appends what a file declares.
  void Append(Program file);

  Dump dump_;
  CompileResult& result_;
  Program program_;
  /// The bytes of all texts, for the bound on them.
  size_t bytes_ = 0;
};

}  // namespace morphbus::dynarole
