#pragma once

#include <string>

namespace palpate {

/// Text that may stand between tags or in an attribute.
std::string escape_html(const std::string& text);

/// A whole page around `body`: head, style for light and dark, and the script that reads values out of charts.
std::string html_page(const std::string& title, const std::string& body);

}  // namespace palpate
