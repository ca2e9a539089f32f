#include "services/gateway/core/json_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

namespace perdure::gateway {
namespace {

TEST(JsonWriter, PutsCommasWhereJsonWantsThem) {
  JsonWriter json;
  json.begin('{').key("a").begin('[').integer(1).integer(-2).text("x").end(']');
  json.key("b").begin('{').end('}').key("c").boolean(true).key("d").null().end('}');
  EXPECT_EQ(json.str(), R"({"a":[1,-2,"x"],"b":{},"c":true,"d":null})");
}

TEST(JsonWriter, ShortensNumbersAndNeverWritesWhatIsNoNumber) {
  JsonWriter json;
  json.begin('[').number(1.5, 4).number(-0.25, 1).number(3.0, 3).number(100.0, 2).number(1e-9, 4);
  json.number(std::numeric_limits<double>::infinity()).number(1e300).number(7.0, 0).end(']');
  const auto parsed = nlohmann::json::parse(json.str());
  EXPECT_EQ(json.str().substr(0, 20), "[1.5,-0.2,3,100,0,0,");
  EXPECT_DOUBLE_EQ(parsed[6].get<double>(), 1e300);
  EXPECT_EQ(parsed[7], 7);
}

TEST(JsonWriter, EscapesWhateverTextComes) {
  std::string every;
  for (int c = 1; c < 256; ++c) every += static_cast<char>(c);
  const std::string valid = "straße \xe2\x82\xac \xf0\x9f\x9a\x97";
  // Overlong encodings, a surrogate, truncated sequences, and a code point beyond the last one.
  const std::string invalid = "\xc0\xaf \xed\xa0\x80 \xe2\x82 \xf4\x90\x80\x80";
  JsonWriter json;
  json.begin('{').textKey("a\"b").text(every).key("v").text(valid).key("i").text(invalid).end('}');
  const auto parsed = nlohmann::json::parse(json.str());
  EXPECT_EQ(parsed["v"], valid);
  EXPECT_EQ(parsed["i"], "?? ??? ?? ????");
  EXPECT_EQ(parsed["a\"b"].get<std::string>().substr(0, 126), every.substr(0, 126));
}

TEST(Base64, IsThatOfRfc4648) {
  const auto of = [](std::string_view text) {
    return base64({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  };
  EXPECT_EQ(of(""), "");
  EXPECT_EQ(of("f"), "Zg==");
  EXPECT_EQ(of("fo"), "Zm8=");
  EXPECT_EQ(of("foob"), "Zm9vYg==");
  EXPECT_EQ(of("foobar"), "Zm9vYmFy");
  EXPECT_EQ(of("\xff\xfe\xfd"), "//79");
}

}  // namespace
}  // namespace perdure::gateway
