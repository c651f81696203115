morphbus_test(logger_drawing_test
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/drawing_test.cc
  DEPS morphbus_drawing morphbus_test_sim morphbus_cairo
  LABELS fast)
