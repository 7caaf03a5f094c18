#include "elementary.c"
#include "formula.c"
#include "image.c"
#include "model.c"

#define WIDTH 120
typedef double feature;

static double decide(const feature *x) {
  if (!ec_model_now.header) ec_open(ec_image);
  for (uint32_t i = 0; i < WIDTH; i++) ec_vector[i] = x[i];
  ec_formula_begin();
  while (!ec_formula_slice(0)) continue;
  return ec_answers[0].label;
}
