#include "palpate/instrument/learned_weights.h"

extern "C" {
extern const char palpate_learned_weights[], palpate_learned_weights_end[];
}

namespace palpate {

std::string_view learned_weights() {
  return {palpate_learned_weights, static_cast<size_t>(palpate_learned_weights_end - palpate_learned_weights)};
}

}  // namespace palpate
