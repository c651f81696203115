#pragma once
// What a back end hands over: a text, files that belong to it, and what the format could not keep.

#include <string>
#include <vector>

namespace morphbus::emit {

/// A file that belongs to the main one and lies beside it or in a folder beside it.
struct CompanionFile {
  std::string path;  ///< Relative to the main file's folder, with '/'.
  /// Its whole content, text or binary.
  std::string bytes;
};

/// What one export consists of, in memory: the caller writes it. Nothing in it depends on where the
/// files will lie, but for names that the caller gave.
struct Exported {
  std::string text;  ///< The main file.
  /// Files that the main one refers to, or that it takes to build it.
  std::vector<CompanionFile> companions;
  /// What was lost on the way, a sentence each, for the user.
  std::vector<std::string> warnings;
  /// Folder of companions called 1.xml, 2.xml, …, beside the main file, whether or not there are
  /// any now: what an earlier export left there beyond them is to be removed. Empty: there is none.
  std::string parts_folder = {};
};

}  // namespace morphbus::emit
