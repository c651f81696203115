# Everything comes from Debian, by find_package where Debian ships a config, else by name.
find_package(Threads REQUIRED)
find_package(CLI11 REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(pugixml REQUIRED)
find_package(Protobuf REQUIRED)
find_package(GTest REQUIRED)
find_package(benchmark REQUIRED)

# Bullet in double precision. Its config says how to compile; it lists a library that Debian does not
# ship (BulletInverseDynamics-float64), so those that are needed are named here.
find_package(Bullet REQUIRED CONFIG CONFIGS BulletConfig-float64.cmake)
add_library(morphbus_bullet INTERFACE)
target_include_directories(morphbus_bullet SYSTEM INTERFACE ${BULLET_ROOT_DIR}/${BULLET_INCLUDE_DIRS})
target_compile_options(morphbus_bullet INTERFACE ${BULLET_DEFINITIONS})
target_link_libraries(morphbus_bullet INTERFACE
                      BulletDynamics-float64 BulletCollision-float64 LinearMath-float64)

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
