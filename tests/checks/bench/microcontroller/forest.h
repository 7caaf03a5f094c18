#include "forest_model.h"

#define WIDTH 120
typedef int16_t feature;

static double decide(const feature *x) { return forest_predict(x, WIDTH); }
