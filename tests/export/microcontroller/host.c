/* Answers the questions of input.bin into output.bin, on the host and under QEMU: vectors by the
   graph's outputs, recordings by their vectors or their events. */
#include <stdio.h>

#include "internal.h"

/* Behind the last one, the slices of a decision for each frame are added. */
enum { VECTOR, VECTORS_OF_RECORDING, COSTS, SELFTEST, EVENTS_OF_RECORDING };

typedef struct {
  double t;
  double joints[16];
  uint16_t counts[EC_ROWS * EC_COLS];
  bool valid[EC_ROWS * EC_COLS];
  bool has_joints;
} frame;

static FILE *input;
static FILE *output;

static void take(void *to, size_t bytes) {
  if (fread(to, 1, bytes, input) != bytes) fprintf(stderr, "input.bin is short\n");
}

static void give(const double *values, size_t count) { fwrite(values, 8, count, output); }

static frame next_frame(void) {
  static frame next;
  take(&next.t, sizeof next.t);
  take(next.joints, sizeof next.joints);
  take(&next.has_joints, 1);
  take(next.counts, sizeof next.counts);
  take(next.valid, sizeof next.valid);
  return next;
}

/* Of a vector that is refused, what follows from its distances may be anything. */
static void give_outputs(void) {
  bool refused = false;
  for (uint32_t i = 0; i < EC_TASKS; i++) refused |= ec_answers[i].label < 0;
  for (uint32_t i = 0; i < EC_TASKS; i++) {
    const ec_answer *a = &ec_answers[i];
    const ec_task *task = &ec_tasks[i];
    double label = a->label;
    give(&label, 1);
    for (uint32_t j = 0; j < task->labels; j++) {
      double score = (double)a->votes[j] / task->k;
      give(&score, 1);
    }
    if (refused) continue;
    give(a->distances, task->k);
    for (uint32_t j = 0; j < task->k; j++) {
      double neighbour = a->neighbours[j];
      give(&neighbour, 1);
    }
    if (task->counts != EC_NOWHERE) give(a->label_distances, task->labels);
  }
  if (refused) return;
  double scores[3] = {ec_scores_now.out_of_range, ec_scores_now.outlier_score, ec_scores_now.known_distance};
  give(scores, EC_HAS_OUTLIERS ? 3 : 1);
}

static void give_vector(uint32_t point) {
  ec_close(point);
  ec_vector_begin();
  while (!ec_vector_slice(point)) continue;
  give(ec_vector, EC_WIDTH);
}

/* Of the first contact, each when its window ends. */
static void give_vectors(uint32_t frames) {
  const double one = 1.0;
  const double none = 0.0;
  uint32_t point = 0;
  bool is_there = false;
  ec_begin();
  for (uint32_t i = 0; i < frames; i++) {
    frame next = next_frame();
    if (point == EC_POINTS || (is_there && ec_now.ended)) continue;
    ec_follow(next.counts, next.valid, next.t, next.has_joints ? next.joints : 0, point, false);
    if (!ec_now.under_way || ec_now.frames < EC_DEBOUNCE) continue;
    if (!is_there) give(&one, 1);
    is_there = true;
    double age_s = ec_now.ended ? EC_INFINITY : next.t - ec_now.onset_s;
    while (point < EC_POINTS && age_s >= ec_windows_s[point]) give_vector(point++);
  }
  while (is_there && point < EC_POINTS) give_vector(point++);
  if (!is_there) give(&none, 1);
}

static void give_events(const ec_event *events, int count) {
  if (count < 0) fprintf(stderr, "error %d\n", count);
  for (int i = 0; i < count; i++) {
    const ec_event *e = &events[i];
    double fields[10] = {e->kind,       e->onset_s, e->task,    e->label,      e->window_s,
                         e->confidence, e->flags,   e->nearest, e->stopped_by, e->t_s};
    give(fields, 10);
  }
}

static void work(void) {
  ec_event events[EC_MOST_EVENTS];
  while (ec_is_due()) give_events(events, ec_work(events));
}

/* slices: how many ec_work has after each frame; 0: as many as it wants. */
static void classify(uint32_t frames, uint32_t slices) {
  ec_event events[EC_MOST_EVENTS];
  double end[10] = {-1.0};
  ec_begin();
  for (uint32_t i = 0; i < frames; i++) {
    frame next = next_frame();
    const double *joints = next.has_joints ? next.joints : 0;
    int count = ec_push(next.counts, next.valid, next.t, joints, events);
    if (count == EC_BUSY) {
      work();
      count = ec_push(next.counts, next.valid, next.t, joints, events);
    }
    give_events(events, count);
    for (uint32_t j = 0; j < slices && ec_is_due(); j++) give_events(events, ec_work(events));
    if (slices == 0) work();
  }
  ec_finish();
  work();
  give(end, 10);
}

#if defined(__arm__)
/* With -icount shift=0 QEMU takes a nanosecond for an instruction; the timer of its boards counts down
   at 25 MHz. */
#define TIMER ((volatile uint32_t *)0xE000E010u) /* SysTick's registers */
#define INSTRUCTIONS_OF_TICK 40.0
static void start_timer(void) {
  TIMER[1] = 0xFFFFFFu;
  TIMER[2] = 0;
  TIMER[0] = 5;
}
static uint32_t ticks(void) { return 0xFFFFFFu - TIMER[2]; }
#else
#define INSTRUCTIONS_OF_TICK 0.0
static void start_timer(void) {}
static uint32_t ticks(void) { return 0; }
#endif

/* The instructions of the longest ec_push, of all frames, of the longest slice, and of all slices. */
static void measure(uint32_t frames) {
  double costs[4] = {0.0};
  ec_event events[EC_MOST_EVENTS];
  start_timer();
  ec_begin();
  for (uint32_t i = 0; i < frames; i++) {
    frame next = next_frame();
    uint32_t begin = ticks();
    ec_push(next.counts, next.valid, next.t, next.has_joints ? next.joints : 0, events);
    for (uint32_t part = 0; part == 0 || ec_is_due(); part += 2) {
      if (part) ec_work(events);
      uint32_t end = ticks();
      double spent = INSTRUCTIONS_OF_TICK * ((end - begin) & 0xFFFFFFu);
      if (spent > costs[part ? 2 : 0]) costs[part ? 2 : 0] = spent;
      costs[part ? 3 : 1] += spent;
      begin = ticks();
    }
  }
  give(costs, 4);
}

int main(void) {
  uint32_t question[2];
  input = fopen("input.bin", "rb");
  output = fopen("output.bin", "wb");
  if (!input || !output || ec_model(ec_image) != EC_ACCEPTED) return 1;
  while (fread(question, 4, 2, input) == 2) {
    if (question[0] == VECTOR) {
      take(ec_vector, 8 * EC_WIDTH);
      ec_formula_begin();
      while (!ec_formula_slice(question[1])) continue;
      give_outputs();
    } else if (question[0] == VECTORS_OF_RECORDING) {
      give_vectors(question[1]);
    } else if (question[0] == COSTS) {
      measure(question[1]);
    } else if (question[0] == SELFTEST) {
      double passed = ec_selftest();
      give(&passed, 1);
    } else {
      classify(question[1], question[0] - EVENTS_OF_RECORDING);
    }
  }
  fclose(output);
  return 0;
}
