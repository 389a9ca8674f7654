#pragma once

/// Everything that the two stages need: read a scene, build the map, answer with forces.
#include "palpate/core/errors.h"
#include "palpate/estimate/force_estimator.h"
#include "palpate/estimate/scene.h"
#include "palpate/estimate/tissue_map.h"
#include "palpate/stereo/recording.h"
#include "palpate/stereo/rig.h"
