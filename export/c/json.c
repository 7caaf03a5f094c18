/* Events as lines of JSON, with the keys of `edge-classify run`: edge/decide/events.py. */
#include "internal.h"

#define MOST 9e12 /* seconds whose millionths a number of 64 bits holds */

static const char *const kinds[] = {"onset", "release", "decision"};
static const char *const flags[] = {
    "short", "gap", "frozen", "still_joints", "joint_limits", "missing_taxels", "missing_pose", "late",
    "as_trained", "out_of_range", "unusual", "unknown", "tie", "forced", "uncertified"};

static void text(const char *letters, ec_put put) {
  while (*letters) put(*letters++);
}

/* To millionths, with no more digits than it needs. */
static void number(double x, ec_put put) {
  char digits[20];
  int n = 0;
  if (!(x > -MOST && x < MOST)) {
    text("null", put);
    return;
  }
  uint64_t millionths = (uint64_t)ec_rint((x < 0.0 ? -x : x) * 1e6);
  if (x < 0.0 && millionths) put('-');
  for (; n < 7 || millionths; millionths /= 10) digits[n++] = (char)('0' + millionths % 10);
  int last = 0;
  while (last < 5 && digits[last] == '0') last++;
  while (n-- > last) {
    put(digits[n]);
    if (n == 6) put('.');
  }
}

/* UTF-8 as ASCII: other letters by the numbers of their halves in UTF-16. */
static void quoted(const char *letters, ec_put put) {
  const uint8_t *at = (const uint8_t *)letters;
  put('"');
  while (*at) {
    uint32_t letter = *at++;
    uint32_t more = letter < 0xC0 ? 0 : letter < 0xE0 ? 1 : letter < 0xF0 ? 2 : 3;
    if (more) letter &= 0x3Fu >> more;
    for (; more > 0; more--) letter = letter << 6 | (*at++ & 0x3F);
    uint32_t halves[2] = {0xD7C0 + (letter >> 10), 0xDC00 + (letter & 0x3FF)};
    if (letter < 0x10000) halves[1] = letter;
    bool is_plain = letter >= ' ' && letter < 0x7F;
    if (letter == '"' || letter == '\\') put('\\');
    if (is_plain) put((char)letter);
    for (uint32_t i = letter < 0x10000; i < 2 && !is_plain; i++) {
      text("\\u", put);
      for (int shift = 12; shift >= 0; shift -= 4) put("0123456789abcdef"[halves[i] >> shift & 15]);
    }
  }
  put('"');
}

static void pair(const char *key, double x, ec_put put) {
  text(", \"", put);
  text(key, put);
  text("\": ", put);
  number(x, put);
}

static void decision(const ec_event *event, double now_s, ec_put put) {
  static const char *const rules[] = {"", ", \"stopped_by\": \"confidence\"",
                                      ", \"stopped_by\": \"window\""};
  const char *separator = "\"";
  pair("window_s", event->window_s, put);
  text(", \"task\": ", put);
  quoted(ec_task_name(event->task), put);
  text(", \"label\": ", put);
  if (event->label < 0) {
    text("null", put);
  } else {
    quoted(ec_label(event->task, event->label), put);
  }
  pair("confidence", event->confidence, put);
  pair("latency_ms", 1e3 * (now_s - event->t_s), put);
  text(rules[event->stopped_by], put);
  text(", \"flags\": [", put);
  for (uint32_t i = 0; i < sizeof flags / sizeof *flags; i++) {
    if (!(event->flags >> i & 1)) continue;
    text(separator, put);
    text(flags[i], put);
    put('"');
    separator = ", \"";
  }
  put(']');
}

void ec_json(const ec_event *event, double now_s, ec_put put) {
  text("{\"event\": \"", put);
  text(kinds[event->kind], put);
  put('"');
  pair("onset_s", event->onset_s, put);
  if (event->kind == EC_RELEASE_EVENT) pair("released_s", event->t_s, put);
  if (event->kind == EC_DECIDED_EVENT) decision(event, now_s, put);
  text("}\n", put);
}

int ec_work_lines(double (*now_s)(void), ec_put put) {
  ec_event events[EC_MOST_EVENTS];
  int count = ec_work(events);
  for (int i = 0; i < count; i++) ec_json(&events[i], now_s(), put);
  return count;
}

int ec_push_lines(
    const uint16_t *counts, const bool *valid, double t_s, const double *joints,
    double (*now_s)(void), ec_put put) {
  ec_event events[EC_MOST_EVENTS];
  int count = ec_push(counts, valid, t_s, joints, events);
  if (count == EC_BUSY) {
    while (ec_is_due()) ec_work_lines(now_s, put);
    count = ec_push(counts, valid, t_s, joints, events);
  }
  for (int i = 0; i < count; i++) ec_json(&events[i], now_s(), put);
  return count;
}
