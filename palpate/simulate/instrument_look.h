#pragma once

#include "palpate/simulate/instrument_shape.h"
#include "palpate/simulate/render.h"

namespace palpate {

/// What the instrument looks like that make_instrument makes in this place.
SurfaceLook instrument_look(const SimulatedInstrument& instrument, const InstrumentPlace& place, int seed);

}  // namespace palpate
