/* An example: touches as lines of text, the time in seconds and a count for each taxel; its events as
   lines of JSON. `gcc -std=c99 -Os -ffp-contract=off *.c -o decide` builds it. */
#include <stdio.h>

#include "edge_classify.h"

static uint16_t counts[EC_ROWS * EC_COLS];
static double t_s;

static double now_s(void) { return t_s; }

static void put(char letter) { putchar(letter); }

static void work(void) {
  while (ec_is_due()) ec_work_lines(now_s, put);
}

int main(void) {
  if (ec_model(ec_image) != EC_ACCEPTED || !ec_selftest()) return 1;
  while (scanf("%lf", &t_s) == 1) {
    for (int i = 0; i < EC_ROWS * EC_COLS; i++) {
      if (scanf("%hu", &counts[i]) != 1) return 1;
    }
    int count = ec_push_lines(counts, NULL, t_s, NULL, now_s, put);
    if (count < 0) fprintf(stderr, "the frame at %.3f s is refused: %d\n", t_s, count);
    work();
  }
  ec_finish();
  work();
  return 0;
}
