/* plumb_config.h - what a cell file gives a plugin under `config:`, by its keys, for plugins in C. It is no part of the contract: read the JSON that
 * create gets as you like.
 *
 * That JSON is one object that fits the schema under `config` in plugin.yaml, or null where the cell gives nothing: no value is of another kind than
 * the schema says, and what it has under `required` is there. A `default` in the schema is for people to read; a key that the cell leaves out is not
 * there, and what is asked for stays as it was set before. Lists and objects inside are passed over; take a JSON parser where you need them.
 *
 *     double offset_mm = 0;
 *     char port[128] = "/dev/ttyUSB0";
 *     plumb_config_number(config, "offset_mm", &offset_mm);
 *     if (plumb_config_text(config, "port", port, sizeof port) < 0) return PLUMB_REFUSED; // say why with host->fail
 */
#ifndef PLUMB_CONFIG_H
#define PLUMB_CONFIG_H

#include "plumb_plugin.h"

#include <stdlib.h>
#include <string.h>

static inline const char *plumb_config_past_blanks(const char *at, const char *end) {
    while (at < end && strchr(" \t\r\n,:", *at) != NULL && *at != '\0') {
        at++;
    }
    return at;
}

/* From an opening quote to what follows the closing one. */
static inline const char *plumb_config_past_text(const char *at, const char *end) {
    for (at++; at < end && *at != '"'; at++) {
        if (*at == '\\') {
            at++;
        }
    }
    return at < end ? at + 1 : end;
}

static inline const char *plumb_config_past_value(const char *at, const char *end) {
    int depth = 0;
    while (at < end) {
        if (*at == '"') {
            at = plumb_config_past_text(at, end);
            if (depth == 0) {
                return at;
            }
            continue;
        }
        if (depth == 0 && strchr(",} \t\r\n", *at) != NULL) {
            return at;
        }
        if (*at == '{' || *at == '[') {
            depth++;
        } else if ((*at == '}' || *at == ']') && --depth == 0) {
            return at + 1;
        }
        at++;
    }
    return end;
}

/* Where the value of a key begins and ends; NULL where there is no such key. */
static inline const char *plumb_config_find(plumb_bytes config, const char *key, const char **value_end) {
    const char *at = (const char *)config.data, *end = at == NULL ? at : at + config.length;
    at = plumb_config_past_blanks(at, end);
    if (at == end || *at != '{') {
        return NULL;
    }
    at++;
    for (;;) {
        at = plumb_config_past_blanks(at, end);
        if (at == end || *at != '"') {
            return NULL;
        }
        const char *name = at + 1;
        at = plumb_config_past_text(at, end);
        size_t length = (size_t)(at - name) - 1;
        const char *value = plumb_config_past_blanks(at, end);
        at = plumb_config_past_value(value, end);
        if (length == strlen(key) && memcmp(name, key, length) == 0) {
            *value_end = at;
            return value;
        }
    }
}

/* 1 and the number; 0, and *number as it was, where the key is not there. -1 where something else is there. */
static inline int plumb_config_number(plumb_bytes config, const char *key, double *number) {
    const char *end, *value = plumb_config_find(config, key, &end);
    char digits[64], *read;
    if (value == NULL) {
        return 0;
    }
    size_t length = (size_t)(end - value);
    if (length == 0 || length >= sizeof digits || strchr("-0123456789", *value) == NULL) {
        return -1;
    }
    memcpy(digits, value, length);
    digits[length] = '\0';
    double found = strtod(digits, &read);
    if (*read != '\0') {
        return -1;
    }
    *number = found;
    return 1;
}

/* 1 and 1 for true, 0 for false; 0 and -1 as above. */
static inline int plumb_config_flag(plumb_bytes config, const char *key, int *flag) {
    const char *end, *value = plumb_config_find(config, key, &end);
    if (value == NULL) {
        return 0;
    }
    size_t length = (size_t)(end - value);
    int is_true = length == 4 && memcmp(value, "true", 4) == 0;
    if (!is_true && (length != 5 || memcmp(value, "false", 5) != 0)) {
        return -1;
    }
    *flag = is_true;
    return 1;
}

/* 1 and the text, UTF-8 with a final zero; 0, and words as they were, where the key is not there. -1 where something else is there, where `room` bytes do
 * not hold it, and of \u escapes, which plumb writes for control characters alone. */
static inline int plumb_config_text(plumb_bytes config, const char *key, char *words, size_t room) {
    static const char escaped[] = "\"\\/bfnrt", meant[] = "\"\\/\b\f\n\r\t";
    const char *end, *at = plumb_config_find(config, key, &end);
    size_t length = 0;
    if (at == NULL) {
        return 0;
    }
    if (end - at < 2 || *at != '"' || end[-1] != '"') {
        return -1;
    }
    /* Looked at whole before anything is written. */
    for (int pass = 0; pass < 2; pass++) {
        length = 0;
        for (const char *here = at + 1; here < end - 1; here++, length++) {
            char letter = *here;
            if (letter == '\\') {
                const char *which = strchr(escaped, *++here);
                if (which == NULL || *which == '\0') {
                    return -1;
                }
                letter = meant[which - escaped];
            }
            if (pass == 1) {
                words[length] = letter;
            }
        }
        if (length >= room) {
            return -1;
        }
    }
    words[length] = '\0';
    return 1;
}

#endif
