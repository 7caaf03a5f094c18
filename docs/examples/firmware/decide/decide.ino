// Decides on the chip itself, without a computer: one MPR121 with twelve electrodes on the I2C pins
// of an RP2040 or ESP32 class board, which prints what touches them.
//
// Put the files that `edge-classify export --c DIR` writes beside this sketch (not its main.c), of a
// model for 1 x 12 taxels. Arduino compiles C with -std=gnu11; a board whose processor multiplies
// and adds doubles in one instruction needs -ffp-contract=off as well, and the compiler says so.

#include <Wire.h>

#include "baseline.h"
#include "edge_classify.h"

const uint8_t PAD = 0x5A;       // the MPR121's address
const uint8_t FILTERED = 0x04;  // 12 values of 10 bits, two bytes each
const uint8_t RUN = 0x5E;       // ECR: electrodes that are measured
const uint16_t REST_FRAMES = 32;
const int32_t STEP = 820;  // 20 counts a second, at 100 frames a second

static_assert(EC_ROWS * EC_COLS == 12, "export a model for 1 x 12 taxels");

ec_baseline taxels[12];

bool read_pad(uint16_t values[12]) {
  Wire.beginTransmission(PAD);
  Wire.write(FILTERED);
  if (Wire.endTransmission(false) != 0) return false;
  if (Wire.requestFrom(PAD, uint8_t(24)) != 24) return false;
  for (int i = 0; i < 12; i++) {
    const uint8_t low = Wire.read();
    values[i] = uint16_t(low | Wire.read() << 8);
  }
  return true;
}

void setup() {
  Serial.begin(115200);
  Wire.begin();
  Wire.setClock(400000);
  Wire.beginTransmission(PAD);
  Wire.write(RUN);
  Wire.write(0x8F);  // all twelve electrodes
  Wire.endTransmission();
  uint32_t sums[12] = {0};
  uint16_t values[12];
  for (int n = 0; n < REST_FRAMES;) {
    if (!read_pad(values)) continue;
    for (int i = 0; i < 12; i++) sums[i] += values[i];
    n++;
    delay(10);
  }
  for (int i = 0; i < 12; i++) values[i] = uint16_t(sums[i] / REST_FRAMES);
  ec_baseline_begin(taxels, 12, values, 2000);
  if (!ec_selftest()) Serial.println("compile with -ffp-contract=off");
  ec_begin();
}

void print(const ec_event *events, int count) {
  for (int i = 0; i < count; i++) {
    const ec_event &event = events[i];
    if (event.kind != EC_DECIDED_EVENT) continue;
    Serial.print(ec_task_names[event.task]);
    Serial.print(": ");
    Serial.print(event.label < 0 ? "unknown" : ec_labels[event.task][event.label]);
    Serial.print(" ");
    Serial.println(event.confidence, 2);
  }
}

// A frame every 10 ms; between them a decision goes on, slice by slice.
void loop() {
  static uint16_t counts[12];
  static ec_event events[EC_MOST_EVENTS];
  static uint32_t next_ms = 0;
  uint16_t values[12];
  if (int32_t(millis() - next_ms) < 0) {
    if (ec_is_due()) print(events, ec_work(events));
    return;
  }
  next_ms = millis() + 10;
  if (!read_pad(values)) return;
  const double t_s = millis() / 1e3;
  // A touch lowers the MPR121's values; counts rise with it.
  ec_baseline_above(taxels, 12, values, -1, 4, counts);
  if (!ec_is_touched()) ec_baseline_follow(taxels, 12, values, nullptr, STEP);
  int count = ec_push(counts, nullptr, t_s, nullptr, events);
  if (count == EC_BAD_TIME) ec_begin();  // millis() is 0 again after 50 days
  while (count == EC_BUSY) {             // a touch follows another at once
    while (ec_is_due()) print(events, ec_work(events));
    count = ec_push(counts, nullptr, t_s, nullptr, events);
  }
  print(events, count);
}
