#pragma once
// The programs that a run has as images, each verified once.

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "compiler/base/result.h"
#include "vm/image/program.h"

namespace morphbus::tools {

/// Programs by the hashes of their images: the one that the run began with, those of its script,
/// and those that tools lay into its folder.
class RunImages {
 public:
  /// @param own       hash of the image that the run began with.
  /// @param images    images by hash, that one among them; nothing is believed of them yet.
  /// @param folder    the run's, where others may be (ImagePath); empty: there are no others.
  RunImages(uint64_t own, std::map<uint64_t, std::string> images, std::string folder);

  /// The verified program of this hash, which is good as long as this lives; 0 stands for the run's
  /// own. Null if the run has none that can be verified: one that comes later is found then.
  const vm::VerifiedProgram* Find(uint64_t hash);
  /// The image of a program that Find found; empty for others.
  [[nodiscard]] const std::string& Image(uint64_t hash) const;

  /// The program that all modules run in the end: the run's own, or the one that came last.
  [[nodiscard]] uint64_t newest() const { return newest_; }
  /// A program goes out to all modules.
  void SetNewest(uint64_t hash) { newest_ = hash; }
  /// The hash of the newest program with another value of a parameter, whose image can be found
  /// from now on. Fails, in a sentence, if it has no such parameter, or that no such value.
  Result<uint64_t> WithParameter(const std::string& name, const std::string& value);

 private:
  /// An image, and what the verifier made of it, which refers to its bytes.
  struct Verified {
    std::unique_ptr<const std::string> image;
    std::unique_ptr<vm::VerifiedProgram> program;
  };

  uint64_t own_;
  uint64_t newest_;
  std::map<uint64_t, std::string> images_;  ///< Not verified yet.
  std::string folder_;
  std::map<uint64_t, Verified> verified_;
};

}  // namespace morphbus::tools
