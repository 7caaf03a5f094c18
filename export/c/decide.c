/* From a contact to its events: edge/decide/classifier.py, answers.py, early.py, model/model.py, info.py,
   agreement.py. */
#include "internal.h"

/* A decision point whose frames have all come. */
typedef struct {
  double t_s;
  double onset_s;
  uint32_t point;
  uint16_t doubts;
  bool is_first; /* of its contact */
} ec_question;

static ec_question questions[EC_MOST_POINTS]; /* of the last contact */
static uint32_t due;                     /* how many of them there are */
static uint32_t asked;                   /* and how many have been taken up */
static ec_question question;             /* the one that is worked at */
static enum { IDLE, MEASURING, COMPUTING } phase;

static ec_event answers[EC_MOST_TASKS]; /* that of a decided task stays */
static int16_t agreed[EC_MOST_TASKS];   /* the labels in which the tasks agree; -1: refused */
static double distances[EC_MOST_TASKS][EC_MOST_LABELS];
static bool decided[EC_MOST_TASKS];
static uint32_t waiting; /* tasks */
static bool announced;   /* whether the onset was */
static double last_s;

/* To millionths, as Python's round does it; x is from 0 to 1. */
static double rounded(double x) {
  double p = x * 1e6;
  double n = ec_rint(p);
  double high = (x * 134217729.0) - (x * 134217729.0 - x); /* Dekker's split */
  double error = (high * 1e6 - p) + (x - high) * 1e6;
  if (p - n == 0.5 && error > 0.0) n += 1.0;
  if (p - n == -0.5 && error < 0.0) n -= 1.0;
  return n / 1e6;
}

static double margin(uint32_t index) {
  const double *distance = distances[index];
  double own = distance[agreed[index]];
  double rival = EC_INFINITY;
  for (int16_t i = 0; i < ec_tasks[index].labels; i++) {
    if (i != agreed[index] && distance[i] < rival) rival = distance[i];
  }
  if (ec_tasks[index].labels == 1) rival = own;
  return own < EC_INFINITY ? rival - own : -EC_INFINITY;
}

static double excess(void) {
  if (!EC_HAS_OUTLIERS) return 0.0;
  double typical = ec_model_now.doubts[question.point].typical;
  double score = ec_scores_now.outlier_score;
  return score > typical && typical > 0.0 ? ec_log(score / typical) : 0.0;
}

/* Probability that the object is one of those in training. */
static double known(void) {
  const ec_doubt *doubt = &ec_model_now.doubts[question.point];
  double score = ec_scores_now.known_distance;
  if (score <= 0.0) return 1.0;
  return ec_logistic(doubt->slope * ec_log(doubt->middle / score));
}

/* The calibrated confidence of a task's label by a curve. */
static double confidence(const double curve[3], uint32_t index) {
  double log_odds = curve[0] * margin(index) + curve[1];
  return ec_logistic(log_odds - curve[2] * excess());
}

/* Of a joint task's label, that of a factor. */
static uint16_t index_of(const ec_task *task, uint32_t factor, uint32_t label) {
  return ec_model_now.words[task->indices[factor] + label];
}

static bool is_joint(const ec_task *task) { return task->indices[0] != EC_NOWHERE; }

/* The nearest answer in which a joint task and its factors agree. */
static void agree(uint32_t index) {
  const ec_task *task = &ec_tasks[index];
  double *total = distances[index];
  uint32_t best = 0;
  for (uint32_t i = 0; i < task->labels; i++) {
    for (uint32_t f = 0; f < 2; f++) {
      total[i] = total[i] + distances[task->factors[f]][index_of(task, f, i)];
    }
    if (total[i] < total[best]) best = i;
  }
  agreed[index] = (int16_t)best;
  for (uint32_t f = 0; f < 2; f++) {
    uint32_t factor = task->factors[f];
    agreed[factor] = (int16_t)index_of(task, f, best);
    for (uint32_t i = 0; i < ec_tasks[factor].labels; i++) distances[factor][i] = EC_INFINITY;
    for (uint32_t i = 0; i < task->labels; i++) {
      double *nearest = &distances[factor][index_of(task, f, i)];
      if (total[i] < *nearest) *nearest = total[i];
    }
  }
}

static void withhold(ec_event *a) {
  a->label = -1;
  a->confidence = 0.0;
  a->flags |= EC_UNKNOWN;
}

static uint16_t flag(bool holds, uint16_t bit) { return holds ? bit : 0; }

/* The model's answer to a task, with the reasons to doubt it. */
static void ask(uint32_t index, bool refused) {
  const ec_task *task = &ec_tasks[index];
  const ec_answer *of_model = &ec_answers[index];
  const ec_doubt *doubt = &ec_model_now.doubts[question.point];
  double window_s = ec_windows_s[question.point];
  ec_event answer = {EC_DECIDED_EVENT, question.t_s, question.onset_s, window_s, 0.0, 0, -1,
                     question.doubts, (uint8_t)index, EC_NOTHING};
  ec_event *a = &answers[index];
  *a = answer;
  a->flags |= flag(refused || ec_scores_now.out_of_range, EC_OUT_OF_RANGE);
  if (refused) return;
  uint32_t most = 0;
  uint32_t ties = 0;
  for (uint32_t i = 0; i < task->labels; i++) {
    uint32_t votes = of_model->votes[i];
    ties = votes > most ? 1 : ties + (votes == most);
    if (votes > most) most = votes;
  }
  a->label = agreed[index];
  a->nearest = of_model->neighbours[0];
  a->flags |= flag(of_model->distances[0] == 0.0, EC_AS_TRAINED);
  a->flags |= flag(ties > 1, EC_TIE);
  a->confidence = EC_NAN;
  if (!EC_NUMBER(calibrated)) return;
  double likely = confidence(ec_model_now.places[question.point * EC_TASKS + index].curve, index);
  if (index == EC_NAMING) likely *= known();
  a->confidence = rounded(likely);
  if (!EC_HAS_OUTLIERS) return;
  a->flags |= flag(ec_scores_now.outlier_score > doubt->outlying, EC_UNUSUAL);
  if (index == EC_NAMING && ec_scores_now.known_distance > doubt->far) withhold(a);
}

/* The model's answers at the decision point to the tasks that wait; whether it refuses. */
static bool ask_all(void) {
  bool refused = false;
  for (uint32_t i = 0; i < EC_TASKS; i++) {
    const ec_task *task = &ec_tasks[i];
    agreed[i] = ec_answers[i].label;
    refused = refused || agreed[i] < 0;
    for (uint32_t j = 0; j < task->labels; j++) distances[i][j] = ec_answers[i].label_distances[j];
  }
  for (uint32_t i = 0; i < EC_TASKS && !refused; i++) {
    if (is_joint(&ec_tasks[i])) agree(i);
  }
  for (uint32_t i = 0; i < EC_TASKS; i++) {
    if (!decided[i]) ask(i, refused);
  }
  return refused;
}

/* The answer of the task's rule. */
static bool stop(ec_event *a, const ec_task *task, bool sure) {
  if (a->label >= 0 && !sure && task->rule_confidence <= 1.0) a->flags |= EC_FORCED;
  a->stopped_by = sure ? EC_CONFIDENCE : EC_WINDOW;
  a->flags &= (uint16_t)~EC_TIE; /* the rule does not go by votes */
  return true;
}

/* A joint task is decided when both factors are, by their labels. */
static bool stop_joint(const ec_task *task, ec_event *a) {
  const ec_event *f[2] = {&answers[task->factors[0]], &answers[task->factors[1]]};
  if (!decided[task->factors[0]] || !decided[task->factors[1]]) return false;
  bool sure = f[0]->stopped_by == EC_CONFIDENCE && f[1]->stopped_by == EC_CONFIDENCE;
  int16_t pair = -1;
  for (uint32_t i = 0; i < task->labels; i++) {
    bool matches = index_of(task, 0, i) == f[0]->label && index_of(task, 1, i) == f[1]->label;
    if (matches) pair = (int16_t)i;
  }
  if (pair < 0 || a->label < 0) {
    withhold(a);
  } else {
    a->label = pair;
    a->confidence = rounded(1.0 * f[0]->confidence * f[1]->confidence);
  }
  return stop(a, task, sure);
}

/* Whether a task is decided at the decision point, by the rule certified for the error rate. */
static bool is_decided(uint32_t index) {
  if (!EC_EARLY) return true;
  const ec_task *task = &ec_tasks[index];
  ec_event *a = &answers[index];
  if (!task->has_rule) {
    a->flags |= EC_UNCERTIFIED;
    return question.point == EC_POINTS - 1;
  }
  if (is_joint(task)) return stop_joint(task, a);
  bool waits = a->flags & EC_UNUSUAL;
  bool sure = confidence(task->rule_curve, index) >= task->rule_confidence;
  uint32_t last = waits ? EC_POINTS - 1 : task->rule_last;
  if (question.point < last && (waits || !sure)) return false;
  return stop(a, task, sure);
}

/* Ask at the decision point; the number of events. Factors come before their joint tasks. */
static int decide(ec_event *events) {
  int count = 0;
  bool refused = ask_all();
  for (int turn = 0; turn < 2; turn++) {
    for (uint32_t i = 0; i < EC_TASKS; i++) {
      if (decided[i] || is_joint(&ec_tasks[i]) != turn) continue;
      if (!refused && !is_decided(i)) continue;
      events[count++] = answers[i];
      decided[i] = true;
      waiting--;
    }
  }
  return count;
}

/* FNV-1a, of whole doubles. */
static void take_in(uint64_t *sum, const double *values, uint32_t n) {
  for (uint32_t i = 0; i < n; i++) {
    union {
      double value;
      uint64_t bits;
    } number = {values[i]};
    *sum = (*sum ^ number.bits) * UINT64_C(1099511628211);
  }
}

bool ec_selftest(void) {
  uint64_t sum = UINT64_C(14695981039346656037);
  for (int i = 1; i <= EC_PROBES; i++) {
    double x = EC_PROBE * i;
    volatile double factor = x; /* read anew, so that the product is not the stored one */
    volatile double square = x * x;
    if (factor * factor - square != 0.0) return false; /* fused */
    double probes[4] = {ec_sin(x), ec_log(x), ec_logistic(x), ec_sqrt(x)};
    take_in(&sum, probes, 4);
  }
  if (!ec_model_now.header) return false;
  for (uint32_t i = 0; i < EC_WIDTH; i++) ec_vector[i] = EC_PROBE;
  ec_formula_begin();
  while (!ec_formula_slice(EC_POINTS - 1)) continue;
  for (uint32_t i = 0; i < EC_TASKS; i++) {
    double label = ec_answers[i].label;
    take_in(&sum, &label, 1);
    take_in(&sum, ec_answers[i].distances, ec_tasks[i].k);
  }
  return sum == EC_NUMBER(checksum);
}

void ec_begin(void) {
  ec_now.ended = true;
  announced = false;
  phase = IDLE;
  asked = due;
  last_s = -EC_INFINITY;
}

ec_refusal ec_model(const void *address) {
  ec_begin();
  return ec_open(address);
}

bool ec_is_touched(void) { return ec_now.under_way && !ec_now.ended; }

bool ec_is_due(void) { return phase != IDLE || asked < due; }

/* Put a question about what has been felt so far. */
static void put(uint32_t point, double t_s, bool is_short) {
  uint16_t doubts = ec_close(point) | flag(is_short, EC_SHORT);
  ec_question next = {t_s, ec_now.onset_s, point, doubts, due == 0};
  questions[due++] = next;
}

int ec_push(
    const uint16_t *counts, const bool *valid, double t_s, const double *joints,
    ec_event events[EC_MOST_EVENTS]) {
  int count = 0;
  bool is_busy = phase == MEASURING || asked < due;
  if (!ec_model_now.header) return EC_NO_MODEL;
  if (!(t_s >= last_s) || t_s - t_s != 0.0) return EC_BAD_TIME;
  for (uint32_t i = joints ? EC_DOF : 0; i-- > 0;) {
    if (!(joints[i] >= -1e6 && joints[i] <= 1e6)) return EC_BAD_JOINTS;
  }
  bool is_first = last_s == -EC_INFINITY;
  if (ec_now.ended) announced = false;
  int error = ec_follow(counts, valid, t_s, joints, announced ? due : 0, is_busy);
  if (error) return error;
  last_s = t_s;
  if (is_first) ec_now.late = ec_now.under_way;
  if (!ec_now.under_way || ec_now.frames < EC_DEBOUNCE) return 0;
  ec_event event = {EC_ONSET_EVENT, t_s, ec_now.onset_s, 0.0, 0.0, 0, -1, 0, 0, EC_NOTHING};
  if (!announced) {
    announced = true;
    events[count++] = event;
    due = 0;
    asked = 0;
  }
  event.kind = EC_RELEASE_EVENT;
  if (ec_now.ended) events[count++] = event;
  while (due < EC_POINTS && (ec_now.ended || t_s - ec_now.onset_s >= ec_windows_s[due])) {
    put(due, t_s, false);
  }
  return count;
}

/* Take up a question, if a task waits for the answer. */
static void take_up(void) {
  question = questions[asked++];
  if (question.is_first) {
    waiting = EC_TASKS;
    for (uint32_t i = 0; i < EC_TASKS; i++) decided[i] = false;
  }
  if (!waiting) return;
  phase = MEASURING;
  ec_vector_begin();
}

int ec_work(ec_event events[EC_MOST_EVENTS]) {
  if (phase == IDLE && asked < due) {
    take_up();
  } else if (phase == MEASURING) {
    if (!ec_vector_slice(question.point)) return 0;
    phase = COMPUTING;
    ec_formula_begin();
  } else if (phase == COMPUTING && ec_formula_slice(question.point)) {
    phase = IDLE;
    return decide(events);
  }
  return 0;
}

void ec_finish(void) {
  if (ec_is_touched() && announced && due < EC_POINTS) put(EC_POINTS - 1, last_s, true);
  ec_now.ended = true;
  announced = false;
  last_s = -EC_INFINITY;
}
