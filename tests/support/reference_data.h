#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

namespace palpate::test {

/// Folder of the reference data: PALPATE_REFERENCE_DATA, or ../shared/data beside the checkout.
std::filesystem::path reference_data();

}  // namespace palpate::test

/// Skips the test, with the reason, where a file or folder of the reference data is missing.
#define PALPATE_NEEDS_REFERENCE(relative)                                                               \
  if (!std::filesystem::exists(palpate::test::reference_data() / (relative)))                           \
  GTEST_SKIP() << "reference data missing: " << (palpate::test::reference_data() / (relative)).string() \
               << " (set PALPATE_REFERENCE_DATA)"
