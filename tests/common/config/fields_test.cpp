#include "common/config/fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "common/base/errors.h"

namespace perdure::config {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

struct Example {
  double gyro_noise = 1e-3;
  std::int64_t max_points = 120;
  bool histogram = false;
  std::string camera = "cam0";
  std::string mode = "fast";
  std::vector<double> offsets = {0.5, -0.25, 0.1};
  std::vector<std::string> classes = {"car", "tab\tand \"quote\"\n"};
  std::string model;
};

Fields describe(Example& e) {
  Fields fields;
  fields.number(
      "imu.gyro_noise", e.gyro_noise, positive(),
      {"noise of the gyroscope", "rad/s/√Hz", "set the Allan-variance value of your IMU"});
  fields.integer("tracker.max_points", e.max_points, between(10, 1000), {"points to track"});
  fields.boolean("tracker.histogram", e.histogram, {"equalise"});
  fields.text("camera", e.camera, {"which camera"});
  fields.choice("mode", e.mode, {"fast", "fine"}, {"speed or accuracy"});
  fields.numbers("imu.offsets", e.offsets, between(-1, 1), {"offsets", "m"}, 3);
  fields.texts("classes", e.classes, {"what to look for"});
  fields.text("model", e.model, {"the network", "", "give the path of an ONNX file"});
  fields.require();
  return fields;
}

std::vector<std::string> lines(const std::vector<Problem>& problems) {
  std::vector<std::string> result;
  for (const Problem& problem : problems) result.push_back(problem.str());
  return result;
}

std::vector<std::string> reading(const std::string& yaml, Example& example) {
  Fields fields = describe(example);
  return lines(readYaml(fields, yaml, "a.yaml"));
}

std::vector<std::string> reading(const std::string& yaml) {
  Example example;
  return reading(yaml, example);
}

TEST(Fields, ReadsEveryTypeOfField) {
  Example e;
  EXPECT_THAT(reading("imu: {gyro_noise: 2.5e-3, offsets: [1, -1, 0.125]}\n"
                      "tracker:\n  max_points: 200\n  histogram: true\n"
                      "camera: left\nmode: fine\nclasses: [chair]\nmodel: \"m.onnx\"\n",
                      e),
              IsEmpty());
  EXPECT_EQ(e.gyro_noise, 2.5e-3);
  EXPECT_THAT(e.offsets, ElementsAre(1, -1, 0.125));
  EXPECT_EQ(e.max_points, 200);
  EXPECT_TRUE(e.histogram);
  EXPECT_EQ(e.camera, "left");
  EXPECT_EQ(e.mode, "fine");
  EXPECT_THAT(e.classes, ElementsAre("chair"));
  EXPECT_EQ(e.model, "m.onnx");
}

TEST(Fields, ATypoAWrongTypeAndAValueOutOfRangeAreAllInOneAnswer) {
  EXPECT_THAT(reading("imu:\n  gyro_noise: -1\ntracker:\n  max_pionts: 50\n  histogram: maybe\n"),
              ElementsAre("a.yaml:2:15: imu.gyro_noise: -1 is not > 0 rad/s/√Hz; set the "
                          "Allan-variance value of your IMU",
                          "a.yaml:4:3: tracker.max_pionts: is not a known key; did you mean "
                          "tracker.max_points?",
                          "a.yaml:5:14: tracker.histogram: maybe is not true or false"));
}

TEST(Fields, FaultyFieldsKeepTheirDefaultsAndGoodOnesAreRead) {
  Example e;
  EXPECT_THAT(reading("imu: {gyro_noise: -1}\ntracker: {max_points: 11}\n", e), SizeIs(1));
  EXPECT_EQ(e.gyro_noise, 1e-3);
  EXPECT_EQ(e.max_points, 11);
}

TEST(Fields, ADoubledKeyIsAProblemAlsoAcrossGroupsAndDottedNames) {
  EXPECT_THAT(reading("mode: fast\nmode: fine\n"),
              ElementsAre("a.yaml:2:1: mode: is given twice; keep one of them"));
  EXPECT_THAT(reading("tracker: {max_points: 20}\ntracker.max_points: 30\n"),
              ElementsAre(HasSubstr("2:1: tracker.max_points: is given twice")));
}

TEST(Fields, WrongTypesAreNamedWithWhatWasExpected) {
  EXPECT_THAT(reading("imu: {gyro_noise: \"0.1\"}"), ElementsAre(HasSubstr("is not a number")));
  EXPECT_THAT(reading("imu: {gyro_noise: .nan}"), ElementsAre(HasSubstr("is not a number")));
  EXPECT_THAT(reading("imu: {gyro_noise: .inf}"), ElementsAre(HasSubstr("is not a number")));
  EXPECT_THAT(reading("tracker: {max_points: 20.5}"),
              ElementsAre(HasSubstr("20.5 is not a whole number")));
  EXPECT_THAT(reading("tracker: {max_points: 99999999999999999999}"),
              ElementsAre(HasSubstr("is not a whole number")));
  EXPECT_THAT(reading("camera: [a]"), ElementsAre(HasSubstr("a list is not a text")));
  EXPECT_THAT(reading("camera:"), ElementsAre(HasSubstr("nothing is not a text")));
  EXPECT_THAT(reading("mode: slow"), ElementsAre(HasSubstr("slow is not one of fast, fine")));
  EXPECT_THAT(reading("classes: car"), ElementsAre(HasSubstr("car is not a list of texts")));
  EXPECT_THAT(reading("tracker: 7"), ElementsAre(HasSubstr("is a group of keys, not a value")));
  EXPECT_THAT(reading("imu: {gyro_noise: {a: 1}}"), ElementsAre(HasSubstr("a group of keys is")));
}

TEST(Fields, ListsAreCheckedInLengthAndElementByElement) {
  EXPECT_THAT(reading("imu: {offsets: [1, 2, 0, 7]}"),
              ElementsAre(HasSubstr("1:20: imu.offsets: 2 is not -1 … 1 m"),
                          HasSubstr("1:26: imu.offsets: 7 is not -1 … 1 m"),
                          HasSubstr("1:16: imu.offsets: has 4 values, not 3")));
}

TEST(Fields, BrokenYamlAndOtherShapesAreProblemsWithAPlace) {
  EXPECT_THAT(reading("mode: fast\n  camera: [\n"), ElementsAre(HasSubstr("a.yaml:2:")));
  EXPECT_THAT(reading("- a\n- b\n"), ElementsAre(HasSubstr("a.yaml:1:1: is not a list of `key")));
  EXPECT_THAT(reading("mode: fast\n---\nmode: fine\n"),
              ElementsAre(HasSubstr("a.yaml:2:1: is not one YAML document")));
  EXPECT_THAT(reading("[a]: 1\n"), ElementsAre(HasSubstr("a key is not a word")));
  EXPECT_THAT(reading(""), IsEmpty());
  EXPECT_THAT(reading("# nothing\n"), IsEmpty());
}

TEST(Fields, AnUnknownKeyFarFromAllKnownOnesPointsToThePrintedConfiguration) {
  EXPECT_THAT(reading("zzzzzzzz: 1"),
              ElementsAre("a.yaml:1:1: zzzzzzzz: is not a known key; --print-config lists the "
                          "known ones"));
  EXPECT_THAT(reading("trackr: {max_points: 3}"), ElementsAre(HasSubstr("did you mean tracker?")));
}

TEST(Fields, AKeyOfEarlierVersionsIsRefusedWithWhatItBecame) {
  double noise = 1.0, gate = 2.0;
  Fields fields;
  fields.number("tracks.noise", noise, positive(), {"noise"});
  fields.expert(true);
  fields.number("tracks.gate", gate, positive(), {"gate"});
  fields.expert(false);
  fields.formerly("tend.noise", "is now tracks.noise");
  fields.formerly("tend.floor", "is fixed at 3; leave it out");
  EXPECT_THAT(lines(readYaml(fields, "tend:\n  noise: 4\n  floor: 2\n  other: 1\n", "a.yaml")),
              ElementsAre("a.yaml:2:3: tend.noise: is now tracks.noise",
                          "a.yaml:3:3: tend.floor: is fixed at 3; leave it out",
                          HasSubstr("a.yaml:4:3: tend.other: is not a known key")));
  EXPECT_THAT(lines(assign(fields, "tend.noise=4")), ElementsAre(HasSubstr("is now tracks.noise")));
  EXPECT_THAT(lines(assign(fields, "tend=4")), ElementsAre(HasSubstr("tend: is a group")));
  EXPECT_EQ(noise, 1.0);
  EXPECT_THAT(toYaml(fields), HasSubstr("# gate (> 0) (expert)"));
  EXPECT_THAT(toYaml(fields), Not(HasSubstr("# noise (> 0) (expert)")));
}

TEST(Fields, ASelfReferringAliasEnds) {
  EXPECT_THAT(reading("tracker: &a\n  max_points: *a\n"), SizeIs(1));
  EXPECT_THAT(reading("x: &a {b: *a}\n"), SizeIs(1));
}

TEST(Fields, ARequiredFieldMayComeFromTheFileOrFromSet) {
  Example e;
  Fields fields = describe(e);
  EXPECT_THAT(lines(missing(fields, "a.yaml")),
              ElementsAre("a.yaml: model: is missing; give the path of an ONNX file"));
  EXPECT_THAT(assign(fields, "model=a=b.onnx"), IsEmpty());
  EXPECT_EQ(e.model, "a=b.onnx");
  EXPECT_THAT(missing(fields, "a.yaml"), IsEmpty());
}

TEST(Fields, SetTakesYamlValuesAndReportsWithoutAPlace) {
  Example e;
  Fields fields = describe(e);
  EXPECT_THAT(assign(fields, "imu.offsets=[0, 0, 1]"), IsEmpty());
  EXPECT_THAT(assign(fields, "model=/a #b: [c/net.onnx"), IsEmpty());
  EXPECT_EQ(e.model, "/a #b: [c/net.onnx") << "a path is not YAML";
  EXPECT_THAT(assign(fields, "model=\"0000\""), IsEmpty());
  EXPECT_EQ(e.model, "0000");
  EXPECT_THAT(e.offsets, ElementsAre(0, 0, 1));
  EXPECT_THAT(lines(assign(fields, "tracker.max_points=5")),
              ElementsAre("--set tracker.max_points=5: tracker.max_points: 5 is not 10 … 1000"));
  EXPECT_THAT(lines(assign(fields, "mode")), ElementsAre("--set mode: is not key=value"));
  EXPECT_THAT(lines(assign(fields, "mode=[")), ElementsAre(HasSubstr("is not YAML")));
}

TEST(Fields, PrintedYamlReadsBackToTheSameValues) {
  Example e;
  e.gyro_noise = 0.1 + 0.2;
  e.model = "päth with # and: colon\\";
  const std::string printed = toYaml(describe(e));
  Example back;
  back.classes.clear();
  EXPECT_THAT(reading(printed, back), IsEmpty()) << printed;
  EXPECT_EQ(back.gyro_noise, e.gyro_noise);
  EXPECT_EQ(back.model, e.model);
  EXPECT_EQ(back.classes, e.classes);
  EXPECT_EQ(toYaml(describe(back)), printed);
}

TEST(Fields, MarkdownHasOneRowForEachField) {
  Example e;
  const std::string table = toMarkdown(describe(e));
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 2 + 8);
  EXPECT_THAT(table, HasSubstr("| `imu.gyro_noise` | `0.001` | rad/s/√Hz | > 0 | noise of the"));
}

TEST(Fields, AFileThatCannotBeReadIsAProblem) {
  Example e;
  Fields fields = describe(e);
  EXPECT_THAT(lines(readFile(fields, "/nonexistent/a.yaml")),
              ElementsAre(HasSubstr("/nonexistent/a.yaml: cannot be read")));
  EXPECT_THAT(lines(readFile(fields, "/proc")), ElementsAre(HasSubstr("cannot be read")));
}

TEST(Fields, RefusingListsEveryProblemWithExitCode78) {
  EXPECT_NO_THROW(refuse({}));
  try {
    refuse({{"a", 1, 2, "x"}, {"b", 0, 0, "y"}});
    FAIL() << "must throw";
  } catch (const StartupError& error) {
    EXPECT_EQ(error.code(), ExitCode::kConfiguration);
    EXPECT_STREQ(error.what(), "a:1:2: x\nb: y");
  }
}

TEST(Fields, RandomBytesNeverCrashTheReader) {
  std::mt19937 random(7);
  const std::string alphabet = "imu:tracker.\n  -[]{}&*!|>'\"%@`#?,~0.1e5\t\xc3\x28";
  for (int i = 0; i < 3000; ++i) {
    std::string text;
    for (std::size_t n = random() % 60; n > 0; --n) text += alphabet[random() % alphabet.size()];
    reading(text);
  }
}

}  // namespace
}  // namespace perdure::config
