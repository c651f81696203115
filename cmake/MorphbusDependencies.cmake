# Everything comes from Debian, by find_package where Debian ships a config, else by name.
find_package(Threads REQUIRED)
find_package(CLI11 REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(pugixml REQUIRED)
find_package(Protobuf REQUIRED)
find_package(SQLite3 REQUIRED)

# Bullet in double precision. Its config says how to compile; it lists a library that Debian does not
# ship (BulletInverseDynamics-float64), so those that are needed are named here.
find_package(Bullet REQUIRED CONFIG CONFIGS BulletConfig-float64.cmake)
add_library(morphbus_bullet INTERFACE)
target_include_directories(morphbus_bullet SYSTEM INTERFACE ${BULLET_ROOT_DIR}/${BULLET_INCLUDE_DIRS})
target_compile_options(morphbus_bullet INTERFACE ${BULLET_DEFINITIONS})
# Where Debian's has contracted operations, tools/exact_bullet makes one that has none (docs/arithmetic.md).
set(MORPHBUS_BULLET "" CACHE PATH "Folder of Bullet's libraries to link in the place of the installed ones")
foreach(library BulletDynamics BulletCollision LinearMath)
  if(MORPHBUS_BULLET)
    if(NOT EXISTS "${MORPHBUS_BULLET}/lib${library}-float64.so")
      message(FATAL_ERROR "MORPHBUS_BULLET: no lib${library}-float64.so in ${MORPHBUS_BULLET}; tools/exact_bullet makes it")
    endif()
    target_link_libraries(morphbus_bullet INTERFACE "${MORPHBUS_BULLET}/lib${library}-float64.so")
  else()
    target_link_libraries(morphbus_bullet INTERFACE ${library}-float64)
  endif()
endforeach()

# LCM ships no CMake config in Debian 12.
find_path(LCM_INCLUDE_DIR lcm/lcm.h REQUIRED)
find_library(LCM_LIBRARY lcm REQUIRED)
find_program(LCM_GEN lcm-gen REQUIRED)
add_library(morphbus_lcm INTERFACE)
target_include_directories(morphbus_lcm SYSTEM INTERFACE ${LCM_INCLUDE_DIR})
target_link_libraries(morphbus_lcm INTERFACE ${LCM_LIBRARY} Threads::Threads)

# Makes the checks of messages (lcmtypes/layouts.py). Nothing that is built needs it to run.
find_package(Python3 3.8 REQUIRED COMPONENTS Interpreter)

# GNU MPFR rounds functions correctly. Debian ships no CMake config of it.
find_library(MPFR_LIBRARY mpfr REQUIRED)
# libpng reads height maps.
find_package(PNG REQUIRED)
# assimp reads meshes. The config that Debian ships names libraries that its package does not need.
find_path(ASSIMP_INCLUDE_DIR assimp/Importer.hpp REQUIRED)
find_library(ASSIMP_LIBRARY assimp REQUIRED)
add_library(morphbus_assimp INTERFACE)
target_include_directories(morphbus_assimp SYSTEM INTERFACE ${ASSIMP_INCLUDE_DIR})
target_link_libraries(morphbus_assimp INTERFACE ${ASSIMP_LIBRARY})

# Debian's zstd ships no CMake config.
find_path(ZSTD_INCLUDE_DIR zstd.h REQUIRED)
find_library(ZSTD_LIBRARY zstd REQUIRED)
add_library(morphbus_zstd INTERFACE)
target_include_directories(morphbus_zstd SYSTEM INTERFACE ${ZSTD_INCLUDE_DIR})
target_link_libraries(morphbus_zstd INTERFACE ${ZSTD_LIBRARY})

# libdeflate for its CRC-32, which takes a tenth of the time of zlib's. Debian ships no CMake config of it.
find_path(DEFLATE_INCLUDE_DIR libdeflate.h REQUIRED)
find_library(DEFLATE_LIBRARY deflate REQUIRED)
add_library(morphbus_deflate INTERFACE)
target_include_directories(morphbus_deflate SYSTEM INTERFACE ${DEFLATE_INCLUDE_DIR})
target_link_libraries(morphbus_deflate INTERFACE ${DEFLATE_LIBRARY})

# libsodium for its SipHash. Linked in where its archive is installed: a process a module would load a library for one
# function. Debian ships no CMake config of it.
find_path(SODIUM_INCLUDE_DIR sodium/crypto_shorthash_siphash24.h REQUIRED)
find_library(SODIUM_LIBRARY NAMES libsodium.a sodium REQUIRED)
add_library(morphbus_sodium INTERFACE)
target_include_directories(morphbus_sodium SYSTEM INTERFACE ${SODIUM_INCLUDE_DIR})
target_link_libraries(morphbus_sodium INTERFACE ${SODIUM_LIBRARY})

# pagmo for its searches. Its shared library takes twice as long to load as morphbus does without it, most of it for
# problems and algorithms that nobody uses here: of the archive the linker takes what is used. tools/CMakeLists.txt says
# how. Debian's config knows the shared library alone.
find_path(PAGMO_INCLUDE_DIR pagmo/algorithm.hpp REQUIRED)
find_library(PAGMO_ARCHIVE libpagmo.a REQUIRED)
find_library(BOOST_SERIALIZATION_LIBRARY boost_serialization REQUIRED)
find_library(TBB_LIBRARY tbb REQUIRED)

find_path(XXHASH_INCLUDE_DIR xxhash.h REQUIRED)
find_path(EXPECTED_INCLUDE_DIR tl/expected.hpp REQUIRED)

find_path(CAIRO_INCLUDE_DIR cairo.h PATH_SUFFIXES cairo REQUIRED)
find_library(CAIRO_LIBRARY cairo REQUIRED)
add_library(morphbus_cairo INTERFACE)
target_include_directories(morphbus_cairo SYSTEM INTERFACE ${CAIRO_INCLUDE_DIR})
target_link_libraries(morphbus_cairo INTERFACE ${CAIRO_LIBRARY})

# Boost.Beast and Boost.Asio: headers only.
find_package(Boost 1.74 REQUIRED)
add_library(morphbus_boost INTERFACE)
target_include_directories(morphbus_boost SYSTEM INTERFACE ${Boost_INCLUDE_DIRS})

# ncurses with wide characters, for the spy's screen.
set(CURSES_NEED_NCURSES TRUE)
set(CURSES_NEED_WIDE TRUE)
find_package(Curses REQUIRED)
add_library(morphbus_curses INTERFACE)
target_include_directories(morphbus_curses SYSTEM INTERFACE ${CURSES_INCLUDE_DIRS})
target_link_libraries(morphbus_curses INTERFACE ${CURSES_LIBRARIES})
# Debian ships no CMake config of libwebp.
find_path(WEBP_INCLUDE_DIR webp/mux.h REQUIRED)
find_library(WEBP_LIBRARY webp REQUIRED)
find_library(WEBPMUX_LIBRARY webpmux REQUIRED)
add_library(morphbus_webp INTERFACE)
target_include_directories(morphbus_webp SYSTEM INTERFACE ${WEBP_INCLUDE_DIR})
target_link_libraries(morphbus_webp INTERFACE ${WEBPMUX_LIBRARY} ${WEBP_LIBRARY})
