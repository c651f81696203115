#pragma once
// What a back end hands over: a text, files that belong to it, and what the format could not keep.

#include <string>
#include <vector>

namespace morphbus::emit {

/// A file beside the main one.
struct CompanionFile {
  std::string path;  ///< Relative to the main file's folder, with '/'.
  std::string bytes;
};

struct Exported {
  std::string text;  ///< The main file.
  std::vector<CompanionFile> companions;
  /// What was lost on the way, a sentence each, for the user.
  std::vector<std::string> warnings;
  /// Folder of companions called 1.xml, 2.xml, …, beside the main file, whether or not there are
  /// any now: what an earlier export left there beyond them is to be removed. Empty: there is none.
  std::string parts_folder = {};
};

}  // namespace morphbus::emit
