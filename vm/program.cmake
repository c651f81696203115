# A program from its bytes to its execution: freestanding, part of the VM core.
morphbus_library(morphbus_vm_program
  SOURCES
    image.cc
    interpreter.cc
    program.cc
    values.cc
    verifier.cc
    verifier_code.cc
    verifier_roles.cc)
target_compile_options(morphbus_vm_program PRIVATE -fno-exceptions -fno-rtti)

# Host side only: an image as text.
morphbus_library(morphbus_vm_disasm
  SOURCES disassembler.cc
  DEPS morphbus_vm_program
  PRIVATE_DEPS fmt::fmt)
