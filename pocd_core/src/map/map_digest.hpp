// Arithmetic modulo 2^128 of the map digest.
#pragma once

#include "pocd/map/map_delta.hpp"

namespace pocd {

void add(MapDigest& sum, const MapDigest& term);
void subtract(MapDigest& sum, const MapDigest& term);

}  // namespace pocd
