#include "services/inference/model_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "common/base/errors.h"
#include "common/base/ids.h"
#include "tests/services/inference/tiny_model.h"

namespace perdure::inference {
namespace {

using ::testing::HasSubstr;

std::string repeated(const std::string& text, int times) {
  std::string all;
  for (int i = 0; i < times; ++i) all += text;
  return all;
}

TEST(ModelFile, WhatIsNoNetworkIsNamed) {
  const std::pair<std::string, const char*> cases[] = {
      {"version https://git-lfs.github.com/spec/v1\noid sha256:1\nsize 3\n", "git lfs pull"},
      {"\n<!DOCTYPE html><html>", "page in HTML"},
      {"<html lang=en>", "page in HTML"},
      {std::string("\x1c\0\0\0TFL3", 8), "TensorFlow Lite"},
      {"\x08\x04\x12\x1c\x0a\x0f\x0a\x05image" + std::string(400, 'm'), "Core ML"},
      {"\x08\x09\x12\x1c\xa2\x01\x0f" + std::string(400, 'm'), "Core ML"},
      {"\x08\x01\x12\x9c\x03\x0a\x0f\x0a\x05serve" + std::string(400, 'm'), "SavedModel"},
      {std::string("\x20\x01\0\0{\"version\"", 13), "TensorRT"},
      {std::string("\x1c\0\0\0ORTM", 8), ".ort"},
      {std::string("\x80\x02}q\0", 5), "pickle"},
      {"\n\x07yolo-v3\x1a", "Caffe"},
      {"PK\x03\x04 archive/data.pkl", "PyTorch"},
      {"<?xml version='1.0'?><net>", "OpenVINO"},
      {"\x1f\x8b\x08", "compressed"},
      {"\x89HDF\r\n", "Keras"},
      {"ftrt\x01", "TensorRT"},
      {"7767517\n3 3\n", "ncnn"},
      {std::string("\x40\0\0\0\0\0\0\0{\"w\":{}}", 16), "safetensors"},
      {std::string(257, 'm') + "ustar" + std::string(300, '\0'), "tar archive"},
      {"\n\x10\n\x05input\x12\x0bPlaceholder", "TensorFlow (.pb)"},
      {"\x08\x07" + repeated("\r\n\x12", 20), "text mode"},
      {std::string(600, '\0'), "zeros only"},
      {"Quota exceeded\n", "text that begins with `Quota exceeded`"}};
  for (const auto& [bytes, words] : cases) EXPECT_THAT(whyNoNetwork(bytes), HasSubstr(words));
  EXPECT_EQ(whyNoNetwork(""), "");
  EXPECT_EQ(whyNoNetwork("\x08\x07\x12\x07pytorch"), "") << "ONNX";
  EXPECT_EQ(whyNoNetwork("\x08\x07\x12\x08Roboflow"), "") << "ONNX";
  EXPECT_EQ(whyNoNetwork("[net]\nwidth=320\n"), "") << "Darknet";
  EXPECT_EQ(whyNoNetwork("\r\n[net]" + repeated("\r\nwidth=320", 20)), "") << "with CR LF";
  EXPECT_EQ(whyNoNetwork("\x08\x07" + repeated("\r\n\x12", 20) + "\n"), "") << "a lone line feed";
}

TEST(ModelFile, AFolderIsNamed) {
  EXPECT_THAT(whyFolderIsNoNetwork("yolo.mlpackage"), HasSubstr("Core ML"));
  EXPECT_THAT(whyFolderIsNoNetwork("weights"), HasSubstr("is a folder"));
}

TEST(ModelFile, ADamagedNetworkIsRefusedByTheDigestOfItsDescription) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("perdure-model-file-" + std::to_string(getpid()));
  const testing::TinyModel tiny;
  const std::string network = tiny.write(folder), described = network + ".model.json";
  std::string digest_of_network;
  const auto read = [&] {
    const std::string key =
        digest_of_network.empty() ? "" : "\"digest\": \"" + digest_of_network + "\", ";
    std::ofstream(described) << "{" << key << tiny.json().substr(1);
    return readModelFile(network, "", {});
  };
  const ModelFile file = read();  // the description has no digest
  digest_of_network = toHex(digest(file.network + file.darknet_weights));
  EXPECT_NO_THROW(read());
  std::fstream weights(folder / "tiny.weights", std::ios::in | std::ios::out | std::ios::binary);
  weights.seekp(30);
  weights.put('\x5a');
  weights.close();
  EXPECT_THROW(
      {
        try {
          read();
        } catch (const StartupError& error) {
          EXPECT_EQ(error.code(), ExitCode::kConfiguration);
          EXPECT_THAT(error.what(), HasSubstr("damaged or replaced"));
          throw;
        }
      },
      StartupError);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace perdure::inference
