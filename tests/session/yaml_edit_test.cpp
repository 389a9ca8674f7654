#include "palpate/session/yaml_edit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "palpate/core/errors.h"

namespace palpate {
namespace {

const std::string kScene =
    "# Überschrift: the uterus\n"
    "recording:   # two files\n"
    "  left: left.mp4   # left camera\n"
    "  right: right.mp4\n"
    "map: {frame: 0, elements: 550,  # n of Eq. 1\n"
    "      organ_region_px: [[1, 2], [3, 4], [5, 6]]}\n"
    "\n"
    "tissue:\n"
    "  # from the paper\n"
    "  young_modulus_kPa: 400\n"
    "  poisson_ratio: 0.35\n"
    "attachments:   # union\n"
    "  - underside: {depth_mm: 3}   # far side\n"
    "  # the rim\n"
    "  - sphere:\n"
    "      center_mm: [0, 0, 90]\n"
    "      radius_mm: 5\n"
    "# the end\n";

std::string changed(const std::vector<std::string>& path, const std::string& value) {
  return with_changes(kScene, {{path, value}});
}

/// kScene with one text replaced by another.
std::string scene_with(const std::string& from, const std::string& to) {
  std::string text = kScene;
  return text.replace(text.find(from), from.size(), to);
}

TEST(YamlEdit, ChangesANumberAndNothingElse) {
  EXPECT_EQ(changed({"tissue", "young_modulus_kPa"}, "27"), scene_with("400", "27"));
  EXPECT_EQ(changed({"map", "elements"}, "800"), scene_with("550", "800"));
  EXPECT_EQ(changed({"recording", "left"}, "\"a b.mp4\""), scene_with("left.mp4", "\"a b.mp4\""));
}

TEST(YamlEdit, ReplacesAPolygonInBrackets) {
  EXPECT_EQ(changed({"map", "organ_region_px"}, "[[7, 8], [9, 9], [1, 1]]"),
            scene_with("[[1, 2], [3, 4], [5, 6]]", "[[7, 8], [9, 9], [1, 1]]"));
}

TEST(YamlEdit, ReplacesAGroupOfLinesByOneLine) {
  EXPECT_EQ(changed({"attachments", "1", "sphere"}, "{center_mm: [1, 1, 1], radius_mm: 2}"),
            scene_with("sphere:\n      center_mm: [0, 0, 90]\n      radius_mm: 5",
                       "sphere: {center_mm: [1, 1, 1], radius_mm: 2}"));
}

TEST(YamlEdit, AddsAKeyInTheStyleOfItsGroup) {
  EXPECT_EQ(changed({"map", "thickness_mm"}, "20"), scene_with("[5, 6]]}", "[5, 6]], thickness_mm: 20}"));
  EXPECT_EQ(changed({"tissue", "law"}, "linear"), scene_with("0.35\n", "0.35\n  law: linear\n"));
  EXPECT_EQ(changed({"recording", "swap"}, "true"), scene_with("right.mp4\n", "right.mp4\n  swap: true\n"));
}

TEST(YamlEdit, AddsAGroupThatIsMissing) {
  EXPECT_EQ(changed({"contact", "grip"}, "push"),
            scene_with("radius_mm: 5\n", "radius_mm: 5\ncontact: {grip: push}\n"));
  EXPECT_EQ(with_changes("", {{{"tissue", "preset"}, "liver"}}), "tissue: {preset: liver}\n");
  EXPECT_EQ(with_changes("map: {}\n", {{{"map", "focus", "radius_mm"}, "3"}}), "map: {focus: {radius_mm: 3}}\n");
  EXPECT_EQ(with_changes("map:\ntissue: {}\n", {{{"map", "frame"}, "3"}}), "map: {frame: 3}\ntissue: {}\n");
}

TEST(YamlEdit, AddsAndTakesAwayItemsOfAList) {
  EXPECT_EQ(changed({"attachments", "+"}, "underside: {depth_mm: 1}"),
            scene_with("radius_mm: 5\n", "radius_mm: 5\n  - underside: {depth_mm: 1}\n"));
  EXPECT_EQ(changed({"attachments", "0"}, ""), scene_with("  - underside: {depth_mm: 3}   # far side\n", ""));
  EXPECT_EQ(changed({"attachments", "1"}, ""),
            scene_with("  - sphere:\n      center_mm: [0, 0, 90]\n      radius_mm: 5\n", ""));
  EXPECT_EQ(with_changes("map: {}\n", {{{"map", "labels", "+"}, "{name: x}"}}), "map: {labels: [{name: x}]}\n");
  EXPECT_EQ(with_changes("a:\n", {{{"a", "+"}, "1"}}), "a: [1]\n");
  EXPECT_EQ(with_changes("a: [1, 2, 3]\n", {{{"a", "1"}, ""}, {{"a", "+"}, "4"}}), "a: [1, 3, 4]\n");
}

TEST(YamlEdit, TakesKeysAway) {
  EXPECT_EQ(changed({"tissue", "poisson_ratio"}, ""), scene_with("  poisson_ratio: 0.35\n", ""));
  EXPECT_EQ(changed({"map", "frame"}, ""), scene_with("frame: 0, ", ""));
  EXPECT_EQ(changed({"map", "focus_px"}, ""), kScene);
  EXPECT_EQ(with_changes("a: {b: 1}\nc: 2\n", {{{"a", "b"}, ""}}), "a: {}\nc: 2\n");
  EXPECT_EQ(with_changes("a:\n  b: 1\nc: 2\n", {{{"a", "b"}, ""}}), "a: {}\nc: 2\n");
}

TEST(YamlEdit, AColonOrABracketInQuotesIsText) {
  const std::string text = "a: {b: \"x]}: # 'y\", c: 'it''s, {'}  # } ]\nd: 1\n";
  EXPECT_EQ(with_changes(text, {{{"a", "c"}, "2"}}), "a: {b: \"x]}: # 'y\", c: 2}  # } ]\nd: 1\n");
}

TEST(YamlEdit, WhatCannotBeChangedInPlaceIsRefusedAndNotSpoiled) {
  const std::string text = "a: &x {b: 1}\nc: *x\n";
  EXPECT_THROW(with_changes(text, {{{"c", "b"}, "2"}}), BadInput);
  EXPECT_THROW(changed({"tissue", "law"}, "[1, 2"), BadInput);
  EXPECT_THROW(changed({"tissue", "law"}, "a\nmap: 3"), BadInput);
}

TEST(YamlEdit, EveryChangeToAndFroGivesTheSameText) {
  for (const auto& path : std::vector<std::vector<std::string>>{
           {"map", "elements"}, {"tissue", "poisson_ratio"}, {"attachments", "1", "sphere", "radius_mm"}}) {
    const std::string there = changed(path, "0.125");
    EXPECT_NE(there, kScene);
    const std::string was = path[0] == "map" ? "550" : path[0] == "tissue" ? "0.35" : "5";
    EXPECT_EQ(with_changes(there, {{path, was}}), kScene);
  }
}

}  // namespace
}  // namespace palpate
