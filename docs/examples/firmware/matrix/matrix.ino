// A 10 x 10 matrix of force-sensitive resistors on an RP2040 or another Arduino, for edge-classify:
// frames over I2C, and the same frames over the USB serial port. An AVR (Uno, Nano) has inputs of
// 10 bits and an I2C buffer of 32 bytes: read it over the serial port.
//
// One CD74HC4067 connects the row under test to 3.3 V, another connects the column under test to
// the analogue input, which a resistor of 10 kOhm pulls to ground. Choose pins that your board leaves
// free: on an ESP32, 6 to 11 belong to its flash. The skin file is edge/skins/matrix.toml.
#include <Wire.h>

#include "protocol.h"

constexpr uint8_t kRows = 10, kCols = 10, kAddress = 0x28;
constexpr uint8_t kRowPins[4] = {2, 3, 6, 7}, kColPins[4] = {8, 9, 10, 11};
constexpr uint8_t kInput = A0;
#ifdef __AVR__
constexpr uint8_t kMissingBits = 2;  // of 12
#else
constexpr uint8_t kMissingBits = 0;
#endif
constexpr uint32_t kPeriodUs = 10000;  // 100 frames a second
constexpr uint32_t kSettleUs = 5;

taxels::Registers<kRows * kCols, 12> registers;
taxels::Link<kRows * kCols, 12> serialLink(registers);
volatile uint8_t pointer = 0;

void select(const uint8_t (&pins)[4], uint8_t number) {
  for (uint8_t bit = 0; bit < 4; bit++) digitalWrite(pins[bit], number >> bit & 1);
}

void onPointer(int) {
  while (Wire.available()) pointer = Wire.read();
}

void onRequest() {
  uint8_t out[decltype(registers)::kFrame];
  Wire.write(out, registers.read(pointer, out));  // 154 bytes: the core's buffer must hold them
}

void setup() {
  for (uint8_t i = 0; i < 4; i++) pinMode(kRowPins[i], OUTPUT), pinMode(kColPins[i], OUTPUT);
#ifndef __AVR__
  analogReadResolution(12);
#endif
  Wire.begin(kAddress);
  Wire.onReceive(onPointer);
  Wire.onRequest(onRequest);
  Serial.begin(2000000);  // over USB any number will do
}

void loop() {
  static uint32_t due = micros();
  static uint16_t values[kRows * kCols];
  while (Serial.available()) serialLink.feed(Serial.read(), [](uint8_t byte) { Serial.write(byte); });
  if (static_cast<int32_t>(micros() - due) < 0) return;
  due += kPeriodUs;
  for (uint8_t row = 0; row < kRows; row++) {
    select(kRowPins, row);
    for (uint8_t col = 0; col < kCols; col++) {
      select(kColPins, col);
      delayMicroseconds(kSettleUs);
      values[row * kCols + col] = analogRead(kInput) << kMissingBits;
    }
  }
  registers.publish(values);
}
