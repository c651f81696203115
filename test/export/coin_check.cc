// Parses a VRML 97 file with Coin and prints its complaints. Status 0: none; 1: some, or not VRML.

#include <Inventor/SoDB.h>
#include <Inventor/SoInput.h>
#include <Inventor/VRMLnodes/SoVRMLGroup.h>
#include <Inventor/errors/SoReadError.h>

#include <cstdio>

namespace {

int complaints = 0;

void Complain(const SoError* error, void* /*unused*/) {
  ++complaints;
  std::fprintf(stderr, "%s\n", error->getDebugString().getString());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  SoDB::init();
  SoReadError::setHandlerCallback(Complain, nullptr);
  SoInput input;
  if (input.openFile(argv[1]) == 0) return 2;
  SoVRMLGroup* const world = SoDB::readAllVRML(&input);
  if (world == nullptr) return 1;
  world->ref();
  world->unref();
  return complaints == 0 ? 0 : 1;
}
