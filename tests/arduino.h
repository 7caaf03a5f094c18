// What the sketch needs of Arduino's core, as declared there: for a check of its syntax alone.
#pragma once
#include <stddef.h>
#include <stdint.h>
#ifndef __AVR__
#include <unistd.h>  // as newlib's cores do: its `link` is a function
#endif

constexpr uint8_t A0 = 14, OUTPUT = 1;
void pinMode(uint8_t pin, uint8_t mode);
void digitalWrite(uint8_t pin, uint8_t value);
int analogRead(uint8_t pin);
#ifndef __AVR__
void analogReadResolution(int bits);
#endif
unsigned long micros();
unsigned long millis();
void delay(unsigned long ms);
void delayMicroseconds(unsigned int us);

struct Stream {
  void begin(unsigned long = 0);
  void setClock(unsigned long);
  void beginTransmission(uint8_t address);
  uint8_t endTransmission(bool stop = true);
  size_t requestFrom(uint8_t address, size_t size);
  size_t println(const char*);
  size_t println(int);
  int available();
  int read();
  size_t write(uint8_t);
  size_t write(const uint8_t*, size_t);
  void onReceive(void (*)(int));
  void onRequest(void (*)());
};
extern Stream Serial, Wire;

struct Memory {
  void begin(size_t);
  uint8_t read(int);
  void write(int, uint8_t);
  bool commit();
};
extern Memory EEPROM;
