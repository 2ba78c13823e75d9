/* Stand-in for ESP-IDF's header: what port/esp-idf takes from it. */
#ifndef STANDIN_ESP_ROM_SYS_H
#define STANDIN_ESP_ROM_SYS_H

#include <stdint.h>

uint32_t esp_rom_get_cpu_ticks_per_us(void);

#endif
