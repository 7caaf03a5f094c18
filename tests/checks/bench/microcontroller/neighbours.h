#define EML_NEIGHBORS_MAX_CLASSES 18
#include "neighbours_model.h"

#define WIDTH 120
typedef int16_t feature;

static double decide(const feature *x) {
  static EmlNeighborsDistanceItem distances[sizeof neighbours_labels / sizeof *neighbours_labels];
  int16_t label = -1;
  eml_neighbors_predict(&neighbours, x, WIDTH, distances, sizeof distances / sizeof *distances, &label);
  return label;
}
