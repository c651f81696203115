# Tests of the program image, verifier, interpreter and disassembler.
add_library(vm_program_test_support STATIC image_builder.cc)
target_include_directories(vm_program_test_support PUBLIC ${CMAKE_SOURCE_DIR})
target_link_libraries(vm_program_test_support
  PUBLIC morphbus_vm_program PRIVATE morphbus_warnings morphbus_sanitize)

morphbus_test(vm_image_test
  SOURCES image_test.cc
  DEPS vm_program_test_support morphbus_vm_disasm dynarole_test_support)
morphbus_test(vm_verifier_test
  SOURCES verifier_test.cc verifier_mutation_test.cc DEPS vm_program_test_support dynarole_test_support)
morphbus_test(vm_interpreter_test
  SOURCES interpreter_test.cc DEPS vm_program_test_support dynarole_test_support)

# The interpreter for compilers without computed goto; its object stands before the library's.
morphbus_test(vm_interpreter_switch_test
  SOURCES interpreter_test.cc ${CMAKE_SOURCE_DIR}/vm/interpreter.cc
  DEPS vm_program_test_support dynarole_test_support)
target_compile_definitions(vm_interpreter_switch_test PRIVATE MORPHBUS_VM_SWITCH)
