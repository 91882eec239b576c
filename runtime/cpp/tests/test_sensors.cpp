// Files of sensors: what is read, and what is said about wrong ones.
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "ln/error.hpp"
#include "ln/sensors.hpp"

namespace {

using namespace ln;
namespace fs = std::filesystem;

const fs::path kPath = fs::temp_directory_path() / ("ln_sensors_" + std::to_string(getpid()) + ".csv");

SensorFile read(const std::string& text) {
  std::ofstream(kPath, std::ios::binary) << text;
  struct Removed {
    ~Removed() { fs::remove(kPath); }
  } removed;
  return read_sensors(kPath.string());
}

/// What is said about a file, without its path.
std::string fault(const std::string& text) {
  try {
    read(text);
  } catch (const Error& error) {
    const std::string message = error.what();
    REQUIRE(message.starts_with(kPath.string() + ":"));
    return message.substr(kPath.string().size() + 1);
  }
  return "";
}

TEST_CASE("rows without names") {
  const SensorFile file = read("1,2.5,-3e-1,0,0,2\n+4, 5 ,6,1,0,0");
  REQUIRE(file.sensors.size() == 2);
  CHECK(file.header == "x,y,z,nx,ny,nz");
  CHECK(file.sensors[0].position == DVec3(1, 2.5, -0.3));
  CHECK(file.sensors[0].normal == Vec3(0, 0, 1));
  CHECK(file.sensors[0].row == "1,2.5,-3e-1,0,0,2");
  CHECK(file.sensors[1].position == DVec3(4, 5, 6));
  CHECK(file.sensors[1].line == 2);
}

TEST_CASE("names put columns into any order, others are kept, earlier results are not") {
  const SensorFile file = read("nx,NY,\"nz\",name,X,y,z,lux\n0,1,0,\"desk, left\",7,8,9,555\n");
  REQUIRE(file.sensors.size() == 1);
  CHECK(file.header == "nx,NY,\"nz\",name,X,y,z");
  CHECK(file.sensors[0].row == "0,1,0,\"desk, left\",7,8,9");
  CHECK(file.sensors[0].position == DVec3(7, 8, 9));
  CHECK(file.sensors[0].normal == Vec3(0, 1, 0));
}

TEST_CASE("byte order mark, comments, empty lines and all line ends") {
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    const SensorFile file =
        read("\xef\xbb\xbf# sensors" + end + "x,y,z,nx,ny,nz" + end + end + "  # one" + end + "1,2,3,0,0,1 " + end);
    REQUIRE(file.sensors.size() == 1);
    CHECK(file.sensors[0].line == 5);
    CHECK(file.sensors[0].row == "1,2,3,0,0,1");
  }
}

TEST_CASE("what is wrong is said with its line") {
  CHECK(fault("x,y,z,nx,ny\n1,2,3,0,0\n") == "1: no column is called nz; a sensor needs x,y,z,nx,ny,nz");
  CHECK(fault("x,y,z,nx,ny,nz,x\n") == "1: two columns are called \"x\"");
  CHECK(fault("1,2,3,0,0,1\n1,2,3,0,0\n") == "2: 5 values where there are 6 columns");
  CHECK(fault("1,2,3\n") == "1: 3 values without a row of names above; a sensor needs x,y,z,nx,ny,nz");
  CHECK(fault("1,2,3,0,0,1\n1,,3,0,0,1\n") == "2: y must be a finite number, not \"\"");
  CHECK(fault("1,2,3,0,0,one\n") == "1: nz must be a finite number, not \"one\"");
  CHECK(fault("1,2,nan,0,0,1\n") == "1: z must be a finite number, not \"nan\"");
  CHECK(fault("1,2,3,0,0,-inf\n") == "1: nz must be a finite number, not \"-inf\"");
  CHECK(fault("1e400,2,3,0,0,1\n") == "1: x must be a finite number, not \"1e400\"");
  CHECK(fault("\n1,2,3,0,0,0\n") == "2: the normal nx,ny,nz is zero; it says which way the sensor looks");
  CHECK(fault("1;2;3;0;0;1\n") == "1: columns are separated by commas; a sensor needs x,y,z,nx,ny,nz");
  CHECK(fault("x,y,z,nx,ny,nz,name\n1,2,3,0,0,1,\"desk\n") == "2: a quotation mark is not closed on its line");
  CHECK(fault("# nothing\n") == " holds no sensors; each row is one: x,y,z,nx,ny,nz");
  CHECK(fault("") == " holds no sensors; each row is one: x,y,z,nx,ny,nz");
  CHECK_THROWS_WITH_AS(read_sensors("/nowhere/sensors.csv"), "/nowhere/sensors.csv: no such file", Error);
}

TEST_CASE("whatever bytes a file holds, it is read or refused") {
  std::string text;
  std::uint32_t state = 1;
  for (int file = 0; file < 300; ++file) {
    text.clear();
    for (int i = 0; i < 60; ++i) {
      state = state * 1664525u + 1013904223u;
      text += "0123,,,\n\r\"#. ex\0\xff\t"[state >> 24 & 15];
    }
    try {
      read(text);
    } catch (const Error&) {
    }
  }
}

}  // namespace
