#include "tools/demo/embedded_drive.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/base/errors.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class EmbeddedModel : public ::testing::Test {
 protected:
  EmbeddedModel() {
    std::string name = (fs::temp_directory_path() / "perdure-models-XXXXXX").string();
    root_ = mkdtemp(name.data());
  }
  ~EmbeddedModel() override { fs::remove_all(root_); }

  std::string refusal() const {
    try {
      embeddedModel(root_);
    } catch (const StartupError& error) {
      EXPECT_EQ(error.code(), ExitCode::kUsage);
      return error.what();
    }
    return "";
  }
  fs::path root_;
};

TEST_F(EmbeddedModel, IsTheOneNetworkInModels) {
  fs::create_directories(root_ / "models");
  std::ofstream(root_ / "models" / "street.json") << "{}";
  std::ofstream(root_ / "models" / "street.onnx") << "";
  EXPECT_EQ(embeddedModel(root_), (root_ / "models" / "street.onnx").string());
  fs::create_directories(root_ / "models" / "demo");
  std::ofstream(root_ / "models" / "demo" / "street.onnx") << "";
  EXPECT_EQ(embeddedModel(root_), (root_ / "models" / "demo" / "street.onnx").string());
}

TEST_F(EmbeddedModel, IsAskedForWhereThereIsNoneOrMoreThanOne) {
  EXPECT_THAT(refusal(), HasSubstr("holds no network; give --model FILE.onnx"));
  fs::create_directories(root_ / "models");
  std::ofstream(root_ / "models" / "a.onnx") << "";
  std::ofstream(root_ / "models" / "b.onnx") << "";
  EXPECT_THAT(refusal(), HasSubstr("more than one network"));
}

TEST(EmbeddedDrive, IsAMinuteOfTheStreetInAFolderOfItsOwn) {
  EXPECT_EQ(embeddedScene().scene, "street");
  EXPECT_GE(embeddedScene().world.seconds.value_or(0.0), 60.0);
  const fs::path folder = embeddedDriveFolder("/cache");
  EXPECT_EQ(folder.parent_path(), "/cache");
  EXPECT_THAT(folder.filename().string(), testing::StartsWith("street-"));
  EXPECT_EQ(folder, embeddedDriveFolder("/cache")) << "or it would be rendered each time";
}

}  // namespace
}  // namespace perdure::tools
