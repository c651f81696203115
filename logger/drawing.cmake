morphbus_library(morphbus_drawing
  SOURCES drawing.cc projection.cc
  DEPS morphbus_model
  PRIVATE_DEPS morphbus_cairo fmt::fmt)
morphbus_use_precompiled(morphbus_drawing morphbus_pch_math)
