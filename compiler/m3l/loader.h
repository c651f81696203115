#pragma once
// Files and what they import, lexed and parsed: the first stages of the compiler (compile.cc makes
// one loader for each compilation).

#include "compiler/m3l/ast.h"
#include "compiler/m3l/compile.h"
#include "compiler/source/import_reader.h"

namespace morphbus::m3l {

/// Reads each file once, imported files before those that import them.
class Loader : public source::ImportReader {
 public:
  /// Sources, diagnostics, trees and the text of stage `dump` go into `output`, which outlives the
  /// loader, as do the texts that are read in place of files (`open`, which may be null).
  Loader(Dump dump, CompileOutput* output, const source::OpenTexts* open = nullptr)
      : ImportReader(source::ReaderOf(open), &output->sources, &output->diagnostics),
        dump_(dump),
        output_(*output) {}

 private:
  void Parse(int file) override;

  Dump dump_;
  CompileOutput& output_;
  /// The number of tokens of all files together, for the bound on them.
  size_t tokens_ = 0;
};

}  // namespace morphbus::m3l
