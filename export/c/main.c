/* An example: touches as lines of text, the time in seconds and a count for each taxel; its answers
   as lines too. `gcc -std=c99 -O2 -ffp-contract=off *.c -o decide` builds it. */
#include <stdio.h>

#include "edge_classify.h"

static void print(const ec_event *event) {
  if (event->kind == EC_ONSET_EVENT) {
    printf("onset at %.3f s\n", event->onset_s);
  } else if (event->kind == EC_RELEASE_EVENT) {
    printf("release\n");
  } else {
    const char *label = event->label < 0 ? "unknown" : ec_labels[event->task][event->label];
    const char *doubt = event->flags & EC_UNUSUAL ? ", but the touch is unusual" : "";
    printf("%s: %s (%.2f)%s\n", ec_task_names[event->task], label, event->confidence, doubt);
  }
}

int main(void) {
  static uint16_t counts[EC_ROWS * EC_COLS];
  ec_event events[EC_MOST_EVENTS];
  double t_s;
  if (!ec_selftest()) return 1;
  ec_begin();
  while (scanf("%lf", &t_s) == 1) {
    for (int i = 0; i < EC_ROWS * EC_COLS; i++) {
      if (scanf("%hu", &counts[i]) != 1) return 1;
    }
    int count = ec_push(counts, NULL, t_s, NULL, events);
    if (count < 0) fprintf(stderr, "the frame at %.3f s is refused: %d\n", t_s, count);
    for (int i = 0; i < count; i++) print(&events[i]);
    while (ec_is_due()) {
      count = ec_work(events);
      for (int i = 0; i < count; i++) print(&events[i]);
    }
  }
  return 0;
}
