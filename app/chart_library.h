#pragma once

namespace palpate::app {

/// Chart.js, minified, as text; generated at configure time from the Debian package.
extern const char* const kChartLibrary;

}  // namespace palpate::app
