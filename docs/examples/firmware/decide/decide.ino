// Reads a skin on the I2C pins of an RP2040 or ESP32 board and prints what touches it, as the
// JSON lines of `edge-classify run`; without a model, or with RECORD, it serves frames for
// `edge-classify record`. Put the files of `edge-classify export --c DIR --skin skin.toml` beside this
// sketch (not their main.c).
//
// A board whose processor multiplies and adds doubles in one instruction needs -ffp-contract=off, and
// the compiler says so. Send `c` to calibrate the first time, while nothing touches the skin.
#include <EEPROM.h>
#include <Wire.h>

#include "skin.h"
#if __has_include("edge_classify.h") && !defined(RECORD)
#include "edge_classify.h"
#define DECIDES 1
static_assert(EC_ROWS == EC_SKIN_ROWS && EC_COLS == EC_SKIN_COLS, "the model is of another skin");
#endif

extern "C" ec_i2c_outcome ec_i2c(
    uint8_t, uint8_t address, const uint8_t *out, size_t n, uint8_t *in, size_t m) {
  if (n == 0 && m == 0) return EC_I2C_DONE;
  Wire.beginTransmission(address);
  Wire.write(out, n);
  const uint8_t failure = n ? Wire.endTransmission(m == 0) : 0;
  if (failure) return failure == 2 ? EC_I2C_NACK : failure == 5 ? EC_I2C_HUNG : EC_I2C_BROKEN;
  if (m == 0) return EC_I2C_DONE;
  const size_t come = Wire.requestFrom(address, m);
  if (come != m) return come ? EC_I2C_BROKEN : EC_I2C_NACK;
  for (size_t i = 0; i < m; i++) in[i] = uint8_t(Wire.read());
  return EC_I2C_DONE;
}

extern "C" uint32_t ec_clock_us(uint32_t wait_us) {
  const uint32_t begin = micros();
  while (uint32_t(micros() - begin) < wait_us) continue;
  return micros();
}

extern "C" bool ec_load(void *bytes, size_t size) {
  for (size_t i = 0; i < size; i++) static_cast<uint8_t *>(bytes)[i] = EEPROM.read(int(i));
  return true;  // what was never kept has another digest
}

extern "C" bool ec_keep(const void *bytes, size_t size) {
  for (size_t i = 0; i < size; i++) EEPROM.write(int(i), static_cast<const uint8_t *>(bytes)[i]);
  return EEPROM.commit();
}

void setup() {
  Serial.begin(2000000);
  Wire.begin();
  Wire.setClock(400000);
  EEPROM.begin(4096);
  while (!ec_skin_begin()) delay(500);
#ifdef DECIDES
  while (!ec_selftest()) Serial.println("{\"error\": \"compile with -ffp-contract=off\"}");
  ec_begin();
#endif
}

#ifdef DECIDES
void print(const ec_event *events, int count) {
  static const char *const names[] = {"onset", "release", "decision"};
  for (const ec_event *e = events; e < events + count; e++) {
    Serial.print("{\"event\": \"");
    Serial.print(names[e->kind]);
    Serial.print("\", \"onset_s\": ");
    Serial.print(e->onset_s, 6);
    if (e->kind == EC_RELEASE_EVENT) {
      Serial.print(", \"release_s\": ");
      Serial.print(e->t_s, 6);
    } else if (e->kind == EC_DECIDED_EVENT) {
      Serial.print(", \"task\": \"");
      Serial.print(ec_task_names[e->task]);
      Serial.print(e->label < 0 ? "\", \"label\": null" : "\", \"label\": \"");
      if (e->label >= 0) Serial.print(ec_labels[e->task][e->label]);
      Serial.print(e->label < 0 ? ", \"confidence\": " : "\", \"confidence\": ");
      Serial.print(e->confidence, 6);
    }
    Serial.println("}");
  }
}
#endif

void loop() {
  ec_frame frame;
#ifdef DECIDES
  static ec_event events[EC_MOST_EVENTS];
  if (Serial.available() && Serial.read() == 'c') {
    Serial.print("{\"calibration\": ");
    Serial.print(double(ec_calibrate(1000, true)), 0);
    Serial.println("}");
  }
  if (!ec_skin_poll(ec_clock_us(0), &frame)) {
    if (ec_is_due()) print(events, ec_work(events));
    return;
  }
  if (!ec_is_calibrated()) return;
  int count = ec_push(frame.counts, frame.valid, frame.t_s, nullptr, events);
  while (count == EC_BUSY) {  // a touch follows another at once
    while (ec_is_due()) print(events, ec_work(events));
    count = ec_push(frame.counts, frame.valid, frame.t_s, nullptr, events);
  }
  print(events, count);
#else
  while (Serial.available()) {
    ec_record(uint8_t(Serial.read()), [](uint8_t byte) { Serial.write(byte); });
  }
  ec_skin_poll(ec_clock_us(0), &frame);
#endif
}
