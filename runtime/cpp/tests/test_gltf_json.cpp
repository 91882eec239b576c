#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest/doctest.h>

#include "../src/gltf_files.hpp"
#include "../src/gltf_json.hpp"
#include "../src/gltf_schema.hpp"
#include "ln/text.hpp"

namespace {

using namespace ln;
using namespace ln::gltf;

std::string parse_error(const std::string& text) {
  try {
    const JsonDocument document("f", text);
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

std::string schema_error(const std::string& text) {
  const JsonDocument document("f", text);
  try {
    check_schema(document.root());
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

std::string decoded(const std::string& uri) {
  MemoryBudget memory(1 << 20);
  return std::string(decode_data_uri(uri, memory).text());
}

}  // namespace

TEST_CASE("text for messages holds no control characters") {
  CHECK(printable("Wände ❤") == "Wände ❤");
  CHECK(printable("a\nb\tc\\") == "a\\nb\\tc\\\\");
  CHECK(printable(std::string("\x1b[31m\0\x7f", 7)) == "\\x1b[31m\\x00\\x7f");
  CHECK(printable("\xc2\x9b") == "\\xc2\\x9b");                                                        // a C1 control
  CHECK(printable("\xff\xe2\x9d") == "\\xff\\xe2\\x9d");                                               // not UTF-8
  CHECK(printable("\xed\xa0\x80\xc0\xaf\xe0\x80\xaf") == "\\xed\\xa0\\x80\\xc0\\xaf\\xe0\\x80\\xaf");  // surrogate, overlong
  CHECK(printable("abcdef", 3) == "abc...");
}

TEST_CASE("numbers and sizes in messages") {
  CHECK(number_text(2) == "2");
  CHECK(number_text(1000000) == "1000000");
  CHECK(number_text(-0.1) == "-0.1");
  CHECK(number_text(1e300) == "1e+300");
  CHECK(bytes_text(7) == "7 bytes");
  CHECK(bytes_text(1536.0 * 1024 * 1024) == "1.5 GiB");
}

TEST_CASE("values are found by name and place") {
  const JsonDocument document("f", R"({"a":[1,{"b":"text","c":true}],"d":{"e":[]},"f":-2.5e1,"g":null})");
  const Json root = document.root();
  CHECK(root.size() == 4);
  const JsonArray a(root["a"]);
  REQUIRE(a.size() == 2);
  CHECK(a[0].number(0) == 1);
  CHECK(a[1]["b"].text() == "text");
  CHECK(a[1]["c"].boolean(false));
  CHECK(a[1]["c"].path() == "a[1].c");
  CHECK(root["d"]["e"].size() == 0);
  CHECK(root["d"]["e"].is_array());
  CHECK(root["f"].number(0) == -25);
  CHECK(root["g"].kind() == JsonKind::null);
  CHECK_FALSE(root["nothing"]["at"]["all"]);
  CHECK(root["nothing"].number(7) == 7);
  CHECK(root["nothing"].text("x") == "x");
  for (const Json value : root["f"]) CHECK_FALSE(value);
}

TEST_CASE("long strings and many strings stay where they are") {
  std::string text = "[";
  for (int i = 0; i < 3000; ++i)
    text += "\"" + std::string(static_cast<std::size_t>(i * 7 % 9000), static_cast<char>('a' + i % 26)) + "\",";
  const JsonDocument document("f", text + "1]");
  int i = 0;
  for (const Json value : document.root()) {
    if (i == 3000) break;
    CHECK(value.text() == std::string(static_cast<std::size_t>(i * 7 % 9000), static_cast<char>('a' + i % 26)));
    ++i;
  }
}

TEST_CASE("objects with many members") {
  std::string text = "{";
  for (int i = 0; i < 1000; ++i) text += "\"k" + std::to_string(i) + "\":" + std::to_string(i) + ",";
  const JsonDocument document("f", text + "\"last\":{}}");
  CHECK(document.root()["k517"].number(0) == 517);
  CHECK(document.root()["last"].is_object());
  CHECK_FALSE(document.root()["k1000"]);
  CHECK(parse_error(text + "\"k7\":0}") == "f: the member \"k7\" occurs twice in one object");
}

TEST_CASE("what strict JSON is not") {
  CHECK(parse_error("{\"a\":1,\"a\":2}") == "f: the member \"a\" occurs twice in one object");
  CHECK(parse_error("[NaN]").find("f: not valid JSON: parse error at line 1, column 2") == 0);
  CHECK(parse_error("[1e400]").find("number overflow") != std::string::npos);
  CHECK(parse_error("[1,]") != "");
  CHECK(parse_error("") != "");
  CHECK(parse_error("[] []") != "");
  CHECK(parse_error("[\"\xff\"]") != "");
  CHECK(parse_error("[\"a\nb\"]").find('\n') == std::string::npos);
  CHECK(parse_error(std::string(512, '[') + std::string(512, ']')) == "");
  CHECK(parse_error(std::string(513, '[') + std::string(513, ']')) == "f: JSON values are nested more than 512 deep");
  CHECK(parse_error(std::string(1000000, '[')) == "f: JSON values are nested more than 512 deep");
}

TEST_CASE("members are checked by the schema") {
  const auto error = [](const std::string& rest) { return schema_error(R"({"asset":{"version":"2.0"},)" + rest + "}"); };
  CHECK(error("\"nodes\":[]") == "");
  CHECK(error("\"nodes\":{}") == "f: nodes: an object where an array is wanted");
  CHECK(error("\"nodes\":[[]]") == "f: nodes[0]: an array where an object is wanted");
  CHECK(error("\"nodes\":[{\"mesh\":0}]") == "f: nodes[0].mesh: there is no meshes[0]");
  CHECK(error("\"nodes\":[{\"children\":[-1]}]") == "f: nodes[0].children[0]: there is no nodes[-1]");
  CHECK(error("\"nodes\":[{\"children\":[0.5]}]") == "f: nodes[0].children[0]: 0.5 is not an integer");
  CHECK(error("\"nodes\":[{\"scale\":[1,2]}]") == "f: nodes[0].scale: 2 numbers where 3 are wanted");
  CHECK(error("\"nodes\":[{\"name\":7}]") == "f: nodes[0].name: a number where a string is wanted");
  CHECK(error("\"materials\":[{\"pbrMetallicRoughness\":{\"roughnessFactor\":2}}]") ==
        "f: materials[0].pbrMetallicRoughness.roughnessFactor: 2 is not within [0, 1]");
  CHECK(error("\"materials\":[{\"pbrMetallicRoughness\":{\"roughnessFactor\":1.000001}}]") == "");
  CHECK(error("\"materials\":[{\"alphaMode\":\"\\u001b\"}]") ==
        "f: materials[0].alphaMode: \"\\x1b\" is none of OPAQUE MASK BLEND");
  CHECK(error("\"materials\":[{\"alphaMode\":\"OPAQUE MASK\"}]") != "");
  CHECK(error("\"cameras\":[{\"type\":\"perspective\",\"perspective\":{\"yfov\":0,\"znear\":1}}]") ==
        "f: cameras[0].perspective.yfov: 0 is not within (0, 3.141592653589793)");
  CHECK(error("\"cameras\":[{\"type\":\"perspective\",\"perspective\":{\"yfov\":1}}]") ==
        "f: cameras[0].perspective.znear: is missing");
  CHECK(error("\"accessors\":[{\"componentType\":5130,\"count\":1,\"type\":\"VEC3\"}]").find("5130 is none of") !=
        std::string::npos);
  CHECK(error("\"accessors\":[{\"componentType\":5126,\"count\":0,\"type\":\"VEC3\"}]")
            .find("accessors[0].count: 0 is not within [1,") != std::string::npos);
  CHECK(error("\"accessors\":[{\"componentType\":5126,\"count\":1e300,\"type\":\"VEC3\"}]") != "");
  CHECK(error("\"meshes\":[{}]") == "f: meshes[0].primitives: is missing");
  CHECK(error("\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}]") ==
        "f: meshes[0].primitives[0].attributes.POSITION: there is no accessors[0]");
  CHECK(error("\"extensions\":{\"KHR_lights_punctual\":{\"lights\":[{\"type\":\"point\",\"intensity\":-1}]}}") ==
        "f: extensions.KHR_lights_punctual.lights[0].intensity: -1 is not 0 or more");
  CHECK(schema_error("{}") == "f: asset: is missing");
}

TEST_CASE("data URIs") {
  CHECK(decoded("data:,a%20b") == "a b");
  CHECK(decoded("data:text/plain;charset=utf-8,%41") == "A");
  CHECK(decoded("data:application/octet-stream;base64,QUJD") == "ABC");
  CHECK(decoded("data:;base64,QUI=") == "AB");
  CHECK(decoded("data:;base64,QUI") == "AB");
  CHECK(decoded("data:;base64,QQ==") == "A");
  CHECK(decoded("data:;base64,") == "");
  CHECK_THROWS_AS(decoded("data:;base64,Q"), Error);
  CHECK_THROWS_AS(decoded("data:;base64,QU!D"), Error);
  CHECK_THROWS_AS(decoded("data:;base64,Q=UD"), Error);
  CHECK_THROWS_AS(decoded("data:application/octet-stream;base64"), Error);
  CHECK_THROWS_AS(decoded("data:application/octet-stream;;base64,AA=="), Error);
}

TEST_CASE("memory is refused before it is allocated") {
  MemoryBudget memory(1000);
  memory.claim(600, "one");
  CHECK_THROWS_WITH_AS(memory.claim(600, "two"),
                       "two needs 600 bytes of memory (600 bytes are in use), more than the limit of 1000 bytes", Error);
  memory.claim(400, "three");
  CHECK_THROWS_AS(memory.claim(1, "four"), Error);
}
