/* Stand-in for Arduino's header: what port/arduino and its sketch take from it. */
#ifndef STANDIN_ARDUINO_H
#define STANDIN_ARDUINO_H

#ifdef __cplusplus
extern "C" {
#endif

#define A0 14
unsigned long micros(void);
void delay(unsigned long ms);
int analogRead(int pin);

#ifdef __cplusplus
}

struct StandinSerial {
    void begin(long)
    {
    }
    void println(const char *)
    {
    }
    void println(float)
    {
    }
};
static StandinSerial Serial __attribute__((unused));
#endif

#endif
