#pragma once

#include <string>

namespace palpate::app {

/// docs/inputs.md: what is read and from which tool, from the readers' own lists.
std::string document_inputs();

}  // namespace palpate::app
