#include "common/replay/files/boxes/detection_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/common/replay/tiny_datasets.h"

namespace perdure::replay {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

DetectionFile readCsv(const std::string& text, DetectionFileOptions options = {}) {
  options.file = freshFolder("detections") / "d.csv";
  writeText(options.file, text);
  return DetectionFile::read(options, ClassAliases());
}
std::string errorOfCsv(const std::string& text) {
  return startupErrorOf([&] { readCsv(text); });
}
constexpr char kHeader[] = "frame,class,x1,y1,x2,y2,score,alpha_semisynthetic\n";

TEST(DetectionFile, AScoreBecomesTheLogitOfItsClassAgainstClutter) {
  const auto file = readCsv(std::string(kHeader) + "2,Car,10,20,30,50,0.8,-1.5\n");
  const auto detections = file.at(2);
  ASSERT_TRUE(detections && detections->size() == 1);
  const Detection& d = detections->front();
  EXPECT_DOUBLE_EQ(d.box.x2, 30);
  ASSERT_EQ(d.activations.size(), 2U);
  EXPECT_EQ(d.activations[0], 0.0F);
  EXPECT_NEAR(d.activations[1], std::log(4.0), 1e-6);
  EXPECT_EQ(d.azimuth, -1.5);
  EXPECT_THAT(file.modelAt(2).classes, ElementsAre("car"));
}

TEST(DetectionFile, AScoreOfOneIsClippedBecauseItIsNotCertainty) {
  const auto file = readCsv("frame,class,x1,y1,x2,y2,score\n0,car,1,2,3,4,1.0\n");
  EXPECT_NEAR(file.at(0)->front().activations[1], std::log(99.0), 1e-5);
}

TEST(DetectionFile, AFrameWithoutRowsHasAnEmptyList) {
  const auto file = readCsv(std::string(kHeader) + "2,Car,10,20,30,50,0.8,\n");
  ASSERT_TRUE(file.at(1));
  EXPECT_THAT(*file.at(1), IsEmpty());
  EXPECT_EQ(file.at(2)->front().azimuth, std::nullopt);
}

TEST(DetectionFile, AListOfFramesSaysWhichFramesHaveAMessageAtAll) {
  DetectionFileOptions options;
  options.file = freshFolder("frames") / "d.csv";
  writeText(options.file, std::string(kHeader) + "2,Car,10,20,30,50,0.8,0\n");
  writeText(options.file.parent_path() / "d.frames", "1 2\n5\n");
  const auto file = DetectionFile::read(options, ClassAliases());
  EXPECT_FALSE(file.at(0));
  EXPECT_THAT(*file.at(1), IsEmpty());
  EXPECT_EQ(file.at(2)->size(), 1U);
  EXPECT_THAT(*file.at(5), IsEmpty());
  writeText(options.file.parent_path() / "d.frames", "1\nx\n");
  EXPECT_THAT(startupErrorOf([&] { DetectionFile::read(options, ClassAliases()); }),
              HasSubstr("d.frames:2"));
}

TEST(DetectionFile, LogitColumnsAreTakenAsTheyAre) {
  const auto file =
      readCsv("frame,class,x1,y1,x2,y2,score,logit:Car,logit:Van\n0,car,1,2,3,4,0.5,1.25,-2\n");
  EXPECT_THAT(file.modelAt(0).classes, ElementsAre("car", "van"));
  EXPECT_THAT(file.at(0)->front().activations, ElementsAre(0.0F, 1.25F, -2.0F));
}

TEST(DetectionFile, DeviationsOfSidesAndAzimuthAreRead) {
  const auto file = readCsv(
      "frame,class,x1,y1,x2,y2,score,azimuth,sigma_azimuth,sigma_x1,sigma_y1,sigma_x2,sigma_y2\n"
      "0,car,1,2,3,4,0.5,1.0,0.1,1,2,3,4\n0,car,5,2,7,4,0.5,1.0,,,,,\n");
  ASSERT_EQ(file.at(0)->size(), 2U);
  EXPECT_THAT(file.at(0)->front().side_sigma, ElementsAre(1.0, 2.0, 3.0, 4.0));
  EXPECT_EQ(file.at(0)->front().azimuth_sigma, 0.1);
  EXPECT_THAT(file.at(0)->back().side_sigma, ElementsAre(0.0, 0.0, 0.0, 0.0));
  EXPECT_EQ(file.at(0)->back().azimuth_sigma, DetectionFileOptions{}.azimuth_sigma);
}

TEST(DetectionFile, ClassesAreKnownFromTheFrameInWhichTheyFirstAppear) {
  const std::string first = "0,car,1,2,3,4,0.5,\n", second = "7,van,1,2,3,4,0.5,\n";
  const auto whole = readCsv(kHeader + first + second);
  const auto prefix = readCsv(kHeader + first);
  EXPECT_THAT(whole.modelAt(6).classes, ElementsAre("car"));
  EXPECT_THAT(whole.modelAt(7).classes, ElementsAre("car", "van"));
  EXPECT_EQ(whole.modelAt(6).hash, prefix.modelAt(6).hash);
  EXPECT_NE(whole.modelAt(7).hash, whole.modelAt(6).hash);
  EXPECT_NEAR(whole.at(7)->front().activations[1], -std::log(99.0), 1e-5) << "it is no car";
}

TEST(DetectionFile, RrcWithoutHeaderNeedsAClassAndIsShiftedOnlyWhenAsked) {
  const std::string rrc = "0,296.021000,160.173000,452.297000,288.372000,0.529230\n";
  EXPECT_THAT(errorOfCsv(rrc), HasSubstr("--class"));
  DetectionFileOptions options;
  options.class_name = "Car";
  const auto as_is = readCsv(rrc, options);
  EXPECT_DOUBLE_EQ(as_is.at(0)->front().box.x1, 296.021);
  EXPECT_THAT(as_is.modelAt(0).classes, ElementsAre("car"));
  options.box_origin = 1.0;
  EXPECT_DOUBLE_EQ(readCsv(rrc, options).at(0)->front().box.x1, 295.021);
}

TEST(DetectionFile, WrongLinesAreWrongDataAndNoFileThatIsMissing) {
  const std::string header(kHeader);
  for (const std::string& text : {std::string(), header + "0,car,1,2,x,4,.5,\n", header + "0,car\n",
                                  std::string("frame\n")}) {
    EXPECT_EQ(startupCodeOf([&] { readCsv(text); }), ExitCode::kData) << text;
  }
}

TEST(DetectionFile, TablesOfOtherProgramsAreReadWhereTheirMeaningIsSure) {
  const std::string header = "frame,class,x1,y1,x2,y2,score,azimuth\n", row = "3,car,1,2,3,4,.5,\n";
  std::string with_semicolons = header + row;
  std::replace(with_semicolons.begin(), with_semicolons.end(), ',', ';');
  for (const std::string& text :
       {"\xEF\xBB\xBF" + header + row, "# " + header + row, with_semicolons,
        header + "3,car,1,2,3,4,.5,\r\n",
        std::string("frame\tclass\tx1\ty1\tx2\ty2\tscore\n3\tcar\t1\t2\t3\t4\t.5\n")}) {
    EXPECT_EQ(errorOfCsv(text), "") << text;
    ASSERT_EQ(readCsv(text).at(3)->size(), 1U) << text;
    EXPECT_EQ(readCsv(text).at(3)->front().box.y2, 4.0) << text;
  }
  DetectionFileOptions options;
  options.class_name = "Car";
  EXPECT_EQ(readCsv("3 1 2 3 4 .5\n", options).at(3)->size(), 1U) << "without a header";
}

DetectionFileOptions ofClass(const char* name) {
  DetectionFileOptions options;
  options.class_name = name;
  return options;
}

TEST(DetectionFile, MotLinesAreReadWithFramesFromOne) {
  const auto file =
      readCsv("1,-1,100,90,40,60,.9,-1,-1,-1\n3,7,10.5,20,30,40,.5,-1,-1,-1\n", ofClass("car"));
  ASSERT_EQ(file.at(0)->size(), 1U);
  EXPECT_DOUBLE_EQ(file.at(0)->front().box.x2, 140.0);
  EXPECT_DOUBLE_EQ(file.at(0)->front().box.y2, 150.0);
  EXPECT_DOUBLE_EQ(file.at(2)->front().box.x1, 10.5);
  EXPECT_EQ(readCsv("1 2 100 90 40 60 1 3 .8\n", ofClass("car")).at(0)->size(), 1U) << "gt.txt";
  const auto wrong = [](const std::string& line) {
    return startupErrorOf([&] { readCsv(line, ofClass("car")); });
  };
  EXPECT_THAT(wrong("0,-1,100,90,40,60,.9,-1,-1,-1\n"),
              HasSubstr("frame is a whole number from 1"));
  EXPECT_THAT(wrong("1,-1,100,90,40,60,-1,-1,-1,-1\n"), HasSubstr("score"));
  EXPECT_THAT(wrong("1,-1,100,90,-40,60,.9,-1,-1,-1\n"), HasSubstr("x1 < x2"));
  EXPECT_THAT(wrong("0 5 5 10 20\n"), HasSubstr("MOT's lines have 7 to 10"));
  for (const char* yolo :
       {"0 .5 .5 .1 .2\n2 .4 1 .1 .2\n", "0 .5 .5 .1 .2 .9\n", "7 0 .5 .5 .1 .2 1\n"}) {
    EXPECT_THAT(errorOfCsv(yolo), HasSubstr("as in YOLO's label files")) << yolo;
  }
}

TEST(DetectionFile, FilesThatAreNoTablesAreNamed) {
  EXPECT_THAT(errorOfCsv("<?xml version=\"1.0\"?>\n<annotations/>\n"),
              HasSubstr("XML, as of CVAT"));
  EXPECT_THAT(errorOfCsv("PK\x03\x04xl/workbook.xml\n"), HasSubstr("a spreadsheet"));
  EXPECT_THAT(errorOfCsv("filename,width,height,class,xmin,ymin,xmax,ymax\n"),
              AllOf(HasSubstr("column x1 is missing"), Not(HasSubstr("a width and a height"))));
}

constexpr char kCocoTables[] =
    R"({"images": [{"id": 11, "file_name": "0/000002.png"}, {"id": 12, "file_name": "x.png"}],
        "categories": [{"id": 3, "name": "Car"}, {"id": 4, "name": "Van"}], "annotations": [)";

TEST(DetectionFile, CocoIsReadAsResultsAndWithItsTables) {
  const std::string results =
      R"([{"image_id": 2, "category_id": 3, "bbox": [100, 90, 40, 60], "score": 0.9}])";
  const auto plain = readCsv(results, ofClass("car"));
  ASSERT_EQ(plain.at(2)->size(), 1U);
  EXPECT_DOUBLE_EQ(plain.at(2)->front().box.y2, 150.0);
  EXPECT_THAT(plain.modelAt(2).classes, ElementsAre("car"));
  EXPECT_THAT(*plain.at(0), IsEmpty());
  EXPECT_THAT(errorOfCsv(results), HasSubstr("no name of category 3: give --class"));
  const auto whole = readCsv(
      std::string(kCocoTables) +
      R"({"id": 1, "image_id": 11, "category_id": 4, "bbox": [1, 2, 30.5, 40], "area": 3}]})");
  EXPECT_DOUBLE_EQ(whole.at(2)->front().box.x2, 31.5);
  EXPECT_THAT(whole.modelAt(2).classes, ElementsAre("van"));
  EXPECT_THAT(*whole.at(12), IsEmpty()) << "an image without annotations";
  EXPECT_FALSE(whole.at(0)) << "no image";
}

/// A drive of three frames.
DetectionFileOptions ofDrive() {
  DetectionFileOptions options = ofClass("car");
  options.numbers = {{"1403636579763555584", 0}, {"1403636579813555584", 1}, {"14036366", 2}};
  return options;
}

TEST(DetectionFile, CocoTablesThatCountFromOneAreReadSo) {
  std::string images, boxes;
  for (int k = 1; k <= 3; ++k) {
    const std::string id = std::to_string(k), comma = k == 1 ? "" : ",";
    images += comma + R"({"id": )" + id + R"(, "file_name": "frame_00)" + id + R"(.png"})";
    boxes +=
        comma + R"({"image_id": )" + id + R"(, "category_id": 1, "bbox": [)" + id + "0, 2, 30, 4]}";
  }
  const auto tables =
      readCsv(R"({"images": [)" + images + R"(], "annotations": [)" + boxes + "]}", ofDrive());
  const auto results = readCsv("[" + boxes + "]", ofDrive());
  for (const auto& file : {tables, results}) {
    EXPECT_DOUBLE_EQ(file.at(0)->front().box.x1, 10.0);
    EXPECT_DOUBLE_EQ(file.at(2)->front().box.x1, 30.0);
    EXPECT_THAT(file.note(), HasSubstr("count from 1 and were read so"));
  }
  const auto unsure =
      readCsv(R"([{"image_id": 1, "category_id": 1, "bbox": [1, 2, 30, 4]}])", ofDrive());
  EXPECT_EQ(unsure.at(1)->size(), 1U);
  EXPECT_THAT(unsure.note(), HasSubstr("taken as counted from 0"));
}

TEST(DetectionFile, CocoImagesAreFoundByTheNamesOfTheDrive) {
  const auto file = readCsv(
      R"({"images": [{"id": 7, "file_name": "a/1403636579813555584.jpg"},
                     {"id": 8, "file_name": "1403636579999999999.jpg"}],
          "annotations": [{"image_id": 7, "category_id": 1, "bbox": [1, 2, 30, 4]},
                          {"image_id": 8, "category_id": 1, "bbox": [1, 2, 30, 4]}]})",
      ofDrive());
  EXPECT_EQ(file.at(1)->size(), 1U);
  EXPECT_FALSE(file.at(0));
  EXPECT_EQ(file.rowsBeyond(2), 1U) << "of an image that the drive does not have";
  EXPECT_THAT(startupErrorOf([&] {
                readCsv(R"({"images": [{"id": 7, "file_name": "l/1.png"},
                                       {"id": 8, "file_name": "r/1.png"}], "annotations": []})",
                        ofDrive());
              }),
              HasSubstr("two `images` of frame 1, the second is \"r/1.png\""));
}

TEST(DetectionFile, CornersWithoutHeaderAreNoMotLines) {
  const auto errorOf = [](const std::string& text) {
    return startupErrorOf([&] { readCsv(text, ofClass("car")); });
  };
  EXPECT_THAT(errorOf("0,100,90,140,150,.9,2\n1,101,90,141,150,.8,2\n"),
              HasSubstr("corners in columns 2 to 5 with a score behind them"));
  const std::string third = "0,2,100,90,140,150,.9\n1,2,101,90,141,150,.8\n2,2,99,90,139,150,.8\n";
  EXPECT_THAT(errorOf(third), HasSubstr("corners in columns 3 to 6"));
  DetectionFileOptions options = ofClass("car");
  options.width = 230, options.height = 239;
  EXPECT_THAT(startupErrorOf([&] { readCsv(third, options); }), HasSubstr("columns 3 to 6"));
  options.width = 242, options.height = 240;
  std::string mot = third;
  mot[0] = '3';
  EXPECT_EQ(readCsv(mot, options).at(0)->front().box.x2, 242.0) << "MOT's boxes lie in the image";
}

TEST(DetectionFile, WhatIsWrongInCocoIsNamed) {
  const auto results = [](const std::string& annotation) {
    return startupErrorOf([&] { readCsv("[" + annotation + "]", ofClass("car")); });
  };
  EXPECT_THAT(results(R"({"image_id": 0, "category_id": 3, "bbox": [1, 2, 3, 4)"),
              HasSubstr("is no whole JSON"));
  EXPECT_THAT(startupErrorOf([] { readCsv("{\"frame\": 0}\n{\"frame\": 1}\n", ofClass("car")); }),
              HasSubstr("a JSON document in each line"));
  EXPECT_THAT(results(R"({"image_id": "a", "category_id": 3, "bbox": [1, 2, 3, 4]})"),
              HasSubstr("`image_id`: \"a\""));
  EXPECT_THAT(results(R"({"image_id": 0, "category_id": 3, "segmentation": []})"),
              HasSubstr("annotation 0 without `bbox`"));
  EXPECT_THAT(results(R"({"image_id": 0, "category_id": 3, "bbox": [1, 2, -3, 4]})"),
              HasSubstr("annotation 0 with a `bbox` whose width"));
  EXPECT_THAT(results(R"({"image_id": 0, "category_id": 3, "bbox": [1, 2, 3, 4], "score": "1"})"),
              HasSubstr("annotation 0 with `score`: \"1\""));
  EXPECT_THAT(errorOfCsv(R"({"images": {"0": {"id": 0}}, "annotations": []})"),
              HasSubstr("`images` that are no list"));
  EXPECT_THAT(results(R"({"image_id": 0, "category_id": 3, "bbox": [1, 2, 3, 4]},)"
                      R"({"image_id": 0, "category_id": 1, "bbox": [1, 2, 3, 4]})"),
              HasSubstr("--class names one category only"));
  EXPECT_THAT(errorOfCsv(R"({"version": "5.0", "shapes": []})"), HasSubstr("no list of COCO's"));
  EXPECT_THAT(errorOfCsv("3"), HasSubstr("--class"));
}

TEST(DetectionFile, SharesOfTheImageAndSizesAreRecognised) {
  const std::string header = "frame,class,x1,y1,x2,y2,score\n";
  EXPECT_THAT(errorOfCsv(header + "0,car,.3,.4,.45,.7,.9\n1,car,.3,.4,1.02,.7,.9\n"),
              HasSubstr("shares of the image"));
  EXPECT_EQ(errorOfCsv(header + "0,car,.3,.4,2,3,.9\n"), "");
  EXPECT_THAT(errorOfCsv("frame;class;x1;y1;x2;y2;score\n0;car;1;2;3;4;0,9\n"),
              HasSubstr("0,9 has a decimal comma"));
  EXPECT_THAT(errorOfCsv("frame,class,x,y,w,h,score\n0,car,1,2,3,4,.9\n"),
              HasSubstr("write x2 = x1 + w"));
  std::string sizes = header, cut = header;
  for (int k = 0; k < 60; ++k) {
    sizes += std::to_string(k) + ",car," + std::to_string(20 + k / 10) + ",30,80,90,.9\n";
    cut += std::to_string(k) + ",car," + std::to_string(200 + k) + ",30,319,239,.9\n";
  }
  DetectionFileOptions options;
  options.width = 320, options.height = 240;
  EXPECT_TRUE(readCsv(sizes, options).hasSizes());
  EXPECT_FALSE(readCsv(cut, options).hasSizes()) << "the border of the image cuts them off";
  EXPECT_EQ(readCsv(cut, options).whyOutside(), "");
  EXPECT_THAT(
      readCsv(header + "0,car,300,400,450,700,.9\n", options).whyOutside(),
      HasSubstr("(320x240); boxes reach to 450, 700: they are of images of another size, or "
                "thousandths of the image"));
  EXPECT_THAT(readCsv(header + "0,car,100,90,350,200,.9\n", options).whyBeyond(),
              HasSubstr("1 of 1 boxes reach beyond the right"));
  const std::string whole = header + "0,car,100,90,350,200,.9\n1,car,-40,90,90,200,.9\n";
  EXPECT_EQ(readCsv(whole, options).whyBeyond(), "") << "boxes of whole objects reach out on both";
}

TEST(DetectionFile, EveryWrongLineIsLocated) {
  const std::string h = kHeader;
  EXPECT_THAT(errorOfCsv(h + "0,car,1,2,3,4,0.5,\n0,car,9,2,3,4,0.5,\n"),
              HasSubstr("d.csv:3: x1 < x2"));
  EXPECT_THAT(errorOfCsv(h + "0,car,1,2,3,4,1.5,\n"), HasSubstr(":2: score"));
  EXPECT_THAT(errorOfCsv(h + "-1,car,1,2,3,4,0.5,\n"), HasSubstr(":2: frame"));
  EXPECT_THAT(errorOfCsv(h + "0,,1,2,3,4,0.5,\n"), HasSubstr(":2: class is empty"));
  EXPECT_THAT(errorOfCsv(h + "0,car,1,2,nan,4,0.5,\n"), HasSubstr(":2: x1, y1"));
  EXPECT_THAT(errorOfCsv(h + "0,car,1,2,3,4,0.5,90\n"), HasSubstr(":2: azimuth is in radians"));
  EXPECT_THAT(errorOfCsv(h + "0,car,1,2,3\n"), HasSubstr(":2: 5 fields; 8 are expected"));
  EXPECT_THAT(errorOfCsv("frame,class,x1,y1,x2,score\n"), HasSubstr(":1: column y2 is missing"));
  EXPECT_THAT(errorOfCsv("frame,frame,class,x1,y1,x2,y2,score\n"),
              HasSubstr("frame is there twice"));
  EXPECT_THAT(errorOfCsv("frame,class,x1,y1,x2,y2,score,logit:car\n0,car,1,2,3,4,.5,?\n"),
              HasSubstr(":2: logit:car"));
  EXPECT_THAT(errorOfCsv("frame,class,x1,y1,x2,y2,score,sigma_x1\n"),
              HasSubstr("sigma_y1 is missing"));
  EXPECT_THAT(errorOfCsv("frame,class,x1,y1,x2,y2,score,sigma_x1,sigma_y1,sigma_x2,sigma_y2\n"
                         "0,car,1,2,3,4,.5,1,1,-1,1\n"),
              HasSubstr("sigma_x1 to sigma_y2 are 0 or more"));
  EXPECT_THAT(errorOfCsv(""), HasSubstr("is empty"));
}

}  // namespace
}  // namespace perdure::replay
