#include "palpate/core/settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cstdlib>
#include <fstream>

#include "palpate/core/errors.h"

namespace palpate {
namespace {

enum class Fruit { apple, pear };

struct Options {
  double thickness_mm = 25;
  int elements = 1344;
  Fruit fruit = Fruit::apple;
  Eigen::Vector3d center_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  std::filesystem::path file;
  std::vector<cv::Point2d> region;
  std::vector<double> radii;
  std::string label = "fruit";
};

void describe_basket(Settings& basket, Options& options) {
  basket.text("label", options.label, "label");
  basket.not_yet({"[1]"});
  basket.after_reading([&options] {
    if (options.label == "none") throw BadInput("basket needs a label");
    if (options.label == "wet") throw BadInput("the label is wet");
  });
}

void describe(Settings& settings, Options& options) {
  settings.group("basket", "what holds it", [&options](Settings& basket) { describe_basket(basket, options); });
  settings.not_yet({"ripeness"});
  settings.number("thickness_mm", options.thickness_mm, {0, 500, true, false}, "depth");
  settings.integer("elements", options.elements, {100, 1e6}, "count");
  settings.choice<Fruit>("fruit", options.fruit, {{"apple", Fruit::apple}, {"pear", Fruit::pear}}, "kind");
  settings.vector3("center_mm", options.center_mm, {}, "middle");
  settings.matrix3("axes", options.axes, "rows");
  settings.path("file", options.file, "a file");
  settings.polygon("region_px", options.region, "outline");
  settings.list(
      "spheres", "several", [&options] { return static_cast<int>(options.radii.size()); },
      [&options](int count) { options.radii.assign(static_cast<size_t>(count), 0); },
      [&options](Settings& item, int i) {
        item.number("radius_mm", options.radii[static_cast<size_t>(i)], {0, 9}, "radius");
      });
}

Options read(const std::string& yaml) {
  Options options;
  Settings settings;
  describe(settings, options);
  read_settings(YAML::Load(yaml), {"folder/scene.yaml", "folder"}, settings);
  return options;
}

std::string complaint(const std::string& yaml) {
  try {
    read(yaml);
  } catch (const BadInput& error) {
    return error.what();
  }
  return "nothing";
}

TEST(Settings, ReadsEveryKindOfValue) {
  const Options options = read(
      "thickness_mm: 36\nelements: 550\nfruit: pear\ncenter_mm: [1, 2.5, -3]\naxes: [[0, 1, 0], [1, 0, 0], [0, 0, "
      "1]]\nfile: a/b.mp4\nregion_px: [[0, 1], [2, 3], [4, 5.5]]\nspheres: [{radius_mm: 2}, {radius_mm: 3}]\n");
  EXPECT_EQ(options.thickness_mm, 36);
  EXPECT_EQ(options.elements, 550);
  EXPECT_EQ(options.fruit, Fruit::pear);
  EXPECT_EQ(options.center_mm, Eigen::Vector3d(1, 2.5, -3));
  EXPECT_EQ(options.axes(0, 1), 1);
  EXPECT_EQ(options.file, std::filesystem::path("folder/a/b.mp4"));
  EXPECT_EQ(options.region.back(), cv::Point2d(4, 5.5));
  EXPECT_EQ(options.radii, (std::vector<double>{2, 3}));
}

TEST(Settings, WhatIsWrittenReadsBackAsTheSame) {
  Options options = read("thickness_mm: 0.1\nspheres: [{radius_mm: 2}]\nregion_px: [[0, 1], [2, 3], [4, 5.5]]\n");
  options.axes.row(0) << 0.6, 0.8, 0;
  Settings settings;
  describe(settings, options);
  const Options again = read(write_settings(settings));
  EXPECT_EQ(again.thickness_mm, options.thickness_mm);
  EXPECT_EQ(again.axes, options.axes);
  EXPECT_EQ(again.radii, options.radii);
  EXPECT_EQ(again.region, options.region);
}

TEST(Settings, AMisspeltKeyIsNamedWithItsLineAndTheNearestValidOne) {
  EXPECT_EQ(complaint("elements: 200\nthicknes_mm: 20\n"),
            "folder/scene.yaml:2: thicknes_mm is not a known key; did you mean 'thickness_mm'?");
}

TEST(Settings, AValueOutOfRangeIsNamedWithWhatWasExpected) {
  EXPECT_EQ(complaint("thickness_mm: 0\n"), "folder/scene.yaml:1: thickness_mm is 0, expected 0 < x <= 500");
  EXPECT_EQ(complaint("elements: 550.5\n"), "folder/scene.yaml:1: elements is 550.5, expected a whole number");
  EXPECT_EQ(complaint("spheres: [{radius_mm: 2}, {radius_mm: 10}]\n"),
            "folder/scene.yaml:1: spheres[1].radius_mm is 10, expected 0 <= x <= 9");
}

TEST(Settings, AValueOfTheWrongKindIsNamed) {
  EXPECT_EQ(complaint("thickness_mm: thick\n"),
            "folder/scene.yaml:1: thickness_mm is 'thick', expected a number 0 < x <= 500");
  EXPECT_EQ(complaint("thickness_mm: .nan\n"),
            "folder/scene.yaml:1: thickness_mm is '.nan', expected a number 0 < x <= 500");
  EXPECT_EQ(complaint("fruit: paer\n"),
            "folder/scene.yaml:1: fruit is 'paer', expected one of: apple, pear; did you mean 'pear'?");
  EXPECT_EQ(complaint("center_mm: [1, 2]\n"), "folder/scene.yaml:1: center_mm is a list, expected a list of 3 numbers");
  EXPECT_EQ(complaint("region_px: [[1, 2], [3, 4]]\n"),
            "folder/scene.yaml:1: region_px is a list, expected at least three corners [[x, y], ...]");
}

TEST(Settings, AKeyThatStandsTwiceIsAnError) {
  EXPECT_EQ(complaint("elements: 200\nelements: 300\n"),
            "folder/scene.yaml:2: elements stands there twice, expected once");
}

TEST(Settings, AKeyOfALaterVersionIsRefusedAsSuch) {
  EXPECT_EQ(complaint("elements: 200\nripeness: 3\n"),
            "folder/scene.yaml:2: ripeness is not available yet in this version");
  EXPECT_EQ(complaint("basket: [{label: a}, {label: b}]\n"),
            "folder/scene.yaml:1: basket[1] is not available yet in this version");
}

TEST(Settings, AWordOrAFileIsReadFromTheSettingsFolderAndWrittenBack) {
  enum class Way { walk, ride, map };
  Way way = Way::walk;
  std::filesystem::path file;
  Settings settings;
  settings.choice_or_file<Way>("way", way, {{"walk", Way::walk}, {"ride", Way::ride}}, Way::map, ".onnx", file, "");
  read_settings(YAML::Load("way: here/north.onnx"), {"folder/scene.yaml", "folder"}, settings, "");
  EXPECT_EQ(way, Way::map);
  EXPECT_EQ(file, "folder/here/north.onnx");
  EXPECT_EQ(YAML::Load(write_settings(settings))["way"].as<std::string>(), "folder/here/north.onnx");
  read_settings(YAML::Load("way: ride"), {"folder/scene.yaml", "folder"}, settings, "");
  EXPECT_EQ(way, Way::ride);
  EXPECT_THROW(read_settings(YAML::Load("way: north.png"), {"folder/scene.yaml", "folder"}, settings, ""), BadInput);
}

TEST(Settings, ASentenceOfAGroupNamesTheGroupOnce) {
  EXPECT_EQ(complaint("basket: {label: none}\n"), "folder/scene.yaml:1: basket needs a label");
  EXPECT_EQ(complaint("basket: {label: wet}\n"), "folder/scene.yaml:1: basket: the label is wet");
}

TEST(Settings, WhatAFileSaysIsToldOnOneShortLine) {
  const std::string long_word(500, 'x');
  EXPECT_EQ(complaint("elements: \"1\\n2\"\n"),
            "folder/scene.yaml:1: elements is '1 2', expected a number 100 <= x <= 1000000");
  EXPECT_LT(complaint("elements: " + long_word + "\n").size(), 200u);
  EXPECT_LT(complaint(long_word + ": 1\n").size(), 250u);
}

/// The sentence about a file with this content.
std::string complaint_about_file(const std::string& content) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "palpate_settings_test.yaml";
  std::ofstream(file) << content;
  Options options;
  Settings settings;
  describe(settings, options);
  std::string sentence = "nothing";
  try {
    read_settings_file(file, settings);
  } catch (const BadInput& error) {
    sentence = error.what();
  }
  std::filesystem::remove(file);
  return sentence == "nothing" ? sentence : sentence.substr(sentence.find("palpate_settings_test.yaml"));
}

TEST(Settings, AFileThatIsNoTextIsNotEchoed) {
  EXPECT_EQ(complaint_about_file(std::string("\x7f"
                                             "ELF\x02\x01\0\0\x03 \xff\xfe",
                                             13)),
            "palpate_settings_test.yaml is no text, expected a YAML scene file");
  EXPECT_EQ(complaint_about_file(""), "palpate_settings_test.yaml is empty, expected a YAML scene file");
  EXPECT_THAT(complaint_about_file("elements: [1\n"),
              testing::StartsWith("palpate_settings_test.yaml:2: not valid YAML"));
  EXPECT_THAT(complaint_about_file("elements: &all [1, *all]\n"),
              testing::HasSubstr("not valid YAML: it is nested too"));
}

TEST(Settings, AQuoteThatIsNotClosedIsToldByItsLine) {
  // yaml-cpp takes the lines below for part of the label and ends it without a word.
  EXPECT_THAT(complaint_about_file("basket:\n  label: 'l_%02d.png\n  nothing: here\nelements: 3\n"),
              testing::HasSubstr("yaml:2: not valid YAML: a quote is opened and not closed"));
  EXPECT_THAT(complaint_about_file("basket: {label: \"plum\n  \"}\n"), testing::HasSubstr("yaml:1: not valid YAML"));
  for (const char* label : {"'it''s'", "\"a \\\"plum\\\"\"", "it's", "''", "say \"plum"})
    EXPECT_EQ(complaint_about_file(std::string("basket: {label: ") + label + "}\n"), "nothing") << label;
}

TEST(Settings, ASecondDocumentIsToldByItsLine) {
  EXPECT_THAT(complaint_about_file("---\nelements: 800\n---\nelements: 3000\n"),
              testing::StartsWith("palpate_settings_test.yaml:4: a second document begins here"));
  EXPECT_EQ(complaint_about_file("---\nelements: 800\n---\n...\n"), "nothing");
}

TEST(Settings, AFileInUtf16IsRead) {
  std::string utf16 = "\xFF\xFE";
  for (const char c : std::string("elements: 5000000000\r\n")) utf16 += {c, '\0'};
  EXPECT_THAT(complaint_about_file(utf16), testing::HasSubstr("yaml:1: elements is 5000000000"));
}

TEST(Settings, AMissingFileAndAFolderAreTold) {
  Settings settings;
  const auto sentence = [&settings](const std::string& file) {
    try {
      read_settings_file(file, settings);
    } catch (const BadInput& error) {
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  EXPECT_EQ(sentence("nowhere/scene.yaml"), "nowhere/scene.yaml does not exist, expected a YAML scene file");
  EXPECT_EQ(sentence("/"), "/ is a folder, expected a YAML scene file");
}

TEST(Settings, PathsTakeTheEnvironmentAndSayWhichVariableIsMissing) {
  setenv("PALPATE_TEST_FOLDER", "/somewhere", 1);
  unsetenv("PALPATE_TEST_UNSET");
  EXPECT_EQ(read("file: ${PALPATE_TEST_FOLDER}/x.mp4\n").file, std::filesystem::path("/somewhere/x.mp4"));
  EXPECT_THAT(complaint("file: ${PALPATE_TEST_UNSET}/x.mp4\n"), testing::HasSubstr("PALPATE_TEST_UNSET is not set"));
}

TEST(Settings, DevicesAndPipelinesAreNoFiles) {
  EXPECT_EQ(read("file: 0\n").file, std::filesystem::path("0"));
  EXPECT_EQ(read("file: 'videotestsrc ! appsink'\n").file, std::filesystem::path("videotestsrc ! appsink"));
}

TEST(Settings, EveryKeyIsDocumentedWithItsDefault) {
  Options options;
  Settings settings;
  describe(settings, options);
  const std::string page = document_settings(settings);
  EXPECT_THAT(page, testing::HasSubstr("| `thickness_mm` | `25` | 0 < x <= 500 | depth |"));
  EXPECT_THAT(page, testing::HasSubstr("| `spheres[].radius_mm` | `0` | 0 <= x <= 9 | radius |"));
}

}  // namespace
}  // namespace palpate
