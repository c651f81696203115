# Everything comes from Debian, by find_package where Debian ships a config, else by name.
find_package(Threads REQUIRED)
find_package(CLI11 REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(pugixml REQUIRED)
find_package(Protobuf REQUIRED)
find_package(GTest REQUIRED)
find_package(benchmark REQUIRED)

# Debian ships Eigen's own config only with its -dev package's pkgconfig; headers suffice.
find_path(EIGEN3_INCLUDE_DIR Eigen/Core PATH_SUFFIXES eigen3 REQUIRED)
add_library(morphbus_eigen INTERFACE)
target_include_directories(morphbus_eigen SYSTEM INTERFACE ${EIGEN3_INCLUDE_DIR})

# Bullet in double precision: the -float64 libraries with BT_USE_DOUBLE_PRECISION.
find_path(BULLET_INCLUDE_DIR btBulletDynamicsCommon.h PATH_SUFFIXES bullet REQUIRED)
find_library(BULLET_DYNAMICS64 BulletDynamics-float64 REQUIRED)
find_library(BULLET_COLLISION64 BulletCollision-float64 REQUIRED)
find_library(BULLET_MATH64 LinearMath-float64 REQUIRED)
add_library(morphbus_bullet INTERFACE)
target_include_directories(morphbus_bullet SYSTEM INTERFACE ${BULLET_INCLUDE_DIR})
target_compile_definitions(morphbus_bullet INTERFACE BT_USE_DOUBLE_PRECISION)
target_link_libraries(morphbus_bullet INTERFACE
                      ${BULLET_DYNAMICS64} ${BULLET_COLLISION64} ${BULLET_MATH64})

# LCM ships no CMake config in Debian 12.
find_path(LCM_INCLUDE_DIR lcm/lcm.h REQUIRED)
find_library(LCM_LIBRARY lcm REQUIRED)
find_program(LCM_GEN lcm-gen REQUIRED)
add_library(morphbus_lcm INTERFACE)
target_include_directories(morphbus_lcm SYSTEM INTERFACE ${LCM_INCLUDE_DIR})
target_link_libraries(morphbus_lcm INTERFACE ${LCM_LIBRARY} Threads::Threads)

find_path(XXHASH_INCLUDE_DIR xxhash.h REQUIRED)
find_path(EXPECTED_INCLUDE_DIR tl/expected.hpp REQUIRED)

find_path(CAIRO_INCLUDE_DIR cairo.h PATH_SUFFIXES cairo REQUIRED)
find_library(CAIRO_LIBRARY cairo REQUIRED)
add_library(morphbus_cairo INTERFACE)
target_include_directories(morphbus_cairo SYSTEM INTERFACE ${CAIRO_INCLUDE_DIR})
target_link_libraries(morphbus_cairo INTERFACE ${CAIRO_LIBRARY})
