#pragma once
// The programs that a run has as images, each verified once.

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>

#include "compiler/base/result.h"
#include "tools/base/program.h"
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

  /// The image of a program (by its hash) with another value of a parameter, which Find does not
  /// find yet. Fails, in a sentence, if it has no such parameter, or that no such value.
  Result<CompiledProgram> WithParameter(uint64_t hash, const std::string& name,
                                        const std::string& value);
  /// Keeps an image that was made so, and lays it into the run's folder. Of many the last ones are
  /// kept, so that whoever sets values again and again fills neither memory nor disk.
  void Keep(const CompiledProgram& program);

 private:
  /// An image, and what the verifier made of it, which refers to its bytes.
  struct Verified {
    std::unique_ptr<const std::string> image;
    std::unique_ptr<vm::VerifiedProgram> program;
  };

  uint64_t own_;
  std::map<uint64_t, std::string> images_;  ///< Not verified yet.
  std::string folder_;
  std::map<uint64_t, Verified> verified_;
  std::deque<uint64_t> kept_;  ///< By Keep, the oldest first.
};

}  // namespace morphbus::tools
