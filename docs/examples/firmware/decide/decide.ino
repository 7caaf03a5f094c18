// Reads a skin on the I2C pins of an RP2040, ESP32 or nRF52 board and prints what touches it, as the
// JSON lines of `edge-classify run`; without a model, or with RECORD, it serves frames for
// `edge-classify record`. Put the files of `edge-classify export --c DIR --skin skin.toml` beside this
// sketch (not their main.c). Send `c` to calibrate the first time, while nothing touches the skin.
#include <EEPROM.h>
#include <Wire.h>

#include "skin.h"
#if __has_include("edge_classify.h") && !defined(RECORD)
#include "edge_classify.h"
static_assert(EC_ROWS == EC_SKIN_ROWS && EC_COLS == EC_SKIN_COLS, "the model is of another skin");
#endif

extern "C" ec_i2c_outcome ec_i2c(
    uint8_t, uint8_t address, const uint8_t *out, size_t n, uint8_t *in, size_t m) {
  if (n) Wire.beginTransmission(address);
  if (n) Wire.write(out, n);
  const uint8_t failure = n ? Wire.endTransmission(m == 0) : 0;
  if (failure) return failure == 2 ? EC_I2C_NACK : failure == 5 ? EC_I2C_HUNG : EC_I2C_BROKEN;
  const size_t come = m ? Wire.requestFrom(address, m) : 0;
  for (size_t i = 0; i < come; i++) in[i] = uint8_t(Wire.read());
  return come == m ? EC_I2C_DONE : come ? EC_I2C_BROKEN : EC_I2C_NACK;
}

extern "C" uint32_t ec_clock_us(uint32_t wait_us) {
  for (const uint32_t begin = micros(); uint32_t(micros() - begin) < wait_us;) continue;
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
#ifdef EC_MOST_TASKS
  while (ec_model(ec_image) != EC_ACCEPTED || !ec_selftest()) {
    Serial.println("{\"error\": \"compile with -ffp-contract=off\"}");
  }
#endif
}

void loop() {
  ec_frame frame;
  const bool comes = ec_skin_poll(ec_clock_us(0), &frame);
#ifdef EC_MOST_TASKS
  const ec_put put = [](char letter) { Serial.write(uint8_t(letter)); };
  if (Serial.available() && Serial.read() == 'c') Serial.println(int(ec_calibrate(1000, true)));
  if (comes && ec_is_calibrated()) {
    ec_push_lines(frame.counts, frame.valid, frame.t_s, nullptr, ec_now_s, put);
  }
  ec_work_lines(ec_now_s, put);  // a slice, also where frames come without a pause
#else
  if (Serial.available()) ec_record(uint8_t(Serial.read()), [](uint8_t byte) { Serial.write(byte); });
  (void)comes;
#endif
}
