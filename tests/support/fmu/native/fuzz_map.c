/* Damages a map file in many ways and reads it: usage fuzz_map FILE COUNT. Prints how many were refused and accepted;
   an accepted one is evaluated. Meant to be run under sanitizers. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "map.h"
#include "model.h"

#define NUMBERS (3 * MAP_AXES + MAP_DEFAULTS + 1) /* of the head: axes, defaults, law */

static uint64_t state = 88172645463325252u;

static uint64_t next_random(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return state;
}

static void put(unsigned char *bytes, uint64_t value)
{
    for (int i = 0; i < 8; ++i) {
        bytes[i] = (unsigned char)(value >> 8 * i);
    }
}

static uint64_t word(const unsigned char *bytes)
{
    uint64_t value = 0;
    for (int i = 7; i >= 0; --i) {
        value = value << 8 | bytes[i];
    }
    return value;
}

/* make size and checksum right again, so that the reader looks further */
static void seal(unsigned char *bytes, size_t size)
{
    uint64_t sum = UINT64_C(14695981039346656037);
    if (size < 24) {
        return;
    }
    put(bytes + 8, size);
    for (size_t i = 24; i + 8 <= size; i += 8) {
        sum = (sum ^ word(bytes + i)) * UINT64_C(1099511628211);
    }
    put(bytes + 16, sum);
}

static int finite_outputs(const Map *map)
{
    static Model model;
    int finite = 1;
    model_reset(&model, map, false);
    for (int n = 0; n < 20; ++n) {
        model_set(&model, PRELOAD, (double)(next_random() % 20000));
        model_set(&model, SPEED, (double)(next_random() % 2000) - 1000.0);
        model_set(&model, TEMPERATURE, 250.0 + (double)(next_random() % 150));
        model_set(&model, AXIAL_LOAD, (double)(next_random() % 20000) - 10000.0);
        model_step(&model, 1e-3);
        finite = finite && isfinite(model_get(&model, FRICTION_TORQUE)) && isfinite(model_get(&model, LAMBDA_RATIO));
    }
    return finite;
}

int main(int argc, char **argv)
{
    long refused = 0, accepted = 0, count;
    unsigned char *original, *bytes;
    char message[300];
    size_t size;
    FILE *file;

    if (argc != 3 || (file = fopen(argv[1], "rb")) == NULL) {
        return 2;
    }
    (void)fseek(file, 0, SEEK_END);
    size = (size_t)ftell(file);
    (void)fseek(file, 0, SEEK_SET);
    original = malloc(size);
    if (original == NULL || fread(original, 1, size, file) != size) {
        return 2;
    }
    (void)fclose(file);
    count = strtol(argv[2], NULL, 10);
    for (long n = 0; n < count; ++n) {
        size_t length = size;
        int kind = (int)(n % 6);
        Map *map;
        if (kind == 0) {
            length = (size_t)(next_random() % size);
        }
        /* of its own size, so that a read beyond the end is seen */
        bytes = malloc(length + 16);
        if (bytes == NULL) {
            return 2;
        }
        memcpy(bytes, original, length);
        if (kind == 1) {
            bytes[next_random() % length] ^= (unsigned char)(1u << next_random() % 8);
        } else if (kind == 2) {
            put(bytes + 88 + 8 * (next_random() % NUMBERS), next_random());
            seal(bytes, length);
        } else if (kind == 3) {
            double value = (double)(next_random() % 5000);
            uint64_t bits;
            memcpy(&bits, &value, 8);
            put(bytes + 88 + 8 * (next_random() % NUMBERS), bits);
            seal(bytes, length);
        } else if (kind == 4) {
            put(bytes + 88 + 8 * (NUMBERS + next_random() % ((length - 88) / 8 - NUMBERS)), next_random());
            seal(bytes, length);
        } else if (kind == 5) {
            length = n % 4 ? length + 8 : length - 8 * (1 + next_random() % 100);
            memset(bytes + (length > size ? size : 0), 0, length > size ? 8 : 0);
            seal(bytes, length);
        } else {
            seal(bytes, n % 12 ? length : 0);
        }
        {
            unsigned char *exact = malloc(length ? length : 1);
            if (exact == NULL) {
                return 2;
            }
            memcpy(exact, bytes, length);
            message[0] = '\0';
            map = map_from_bytes(exact, length, MODEL_LAW, "fuzz", message, sizeof message);
            free(exact);
        }
        if (map == NULL) {
            ++refused;
            if (message[0] == '\0') {
                (void)printf("refused without a message\n");
                return 1;
            }
        } else {
            ++accepted;
            (void)finite_outputs(map);
            map_free(map);
        }
        free(bytes);
    }
    {
        Map *map = map_from_bytes(original, size, MODEL_LAW, "original", message, sizeof message);
        if (map == NULL || !finite_outputs(map)) {
            (void)printf("the original is refused: %s\n", message);
            return 1;
        }
        map_free(map);
    }
    free(original);
    (void)printf("%ld refused, %ld accepted\n", refused, accepted);
    return 0;
}
