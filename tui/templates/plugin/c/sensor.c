/* A sensor that measures a height. It makes its readings up: replace `height_mm` by what reads yours.
 * The contract is in plumb_plugin.h: threads, ownership, errors, units. */
#include "plumb_plugin.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct plumb_instance {
    const plumb_host_functions *host;
};

static plumb_bytes text(const char *words) {
    plumb_bytes bytes = { (const uint8_t *)words, strlen(words) };
    return bytes;
}

/* Connects. config is the JSON of what the cell file gives under `config:`, or null; plumb_config.h reads
 * numbers, flags and texts from it. */
static plumb_status create(const plumb_host_functions *host, plumb_bytes config, plumb_instance **instance) {
    (void)config;
    plumb_instance *gauge = calloc(1, sizeof *gauge);
    if (gauge == NULL) {
        host->fail(host->context, text("no memory for a sensor"));
        return PLUMB_FAILED;
    }
    gauge->host = host;
    *instance = gauge;
    return PLUMB_OK;
}

static void destroy(plumb_instance *gauge) {
    free(gauge);
}

static plumb_status describe(plumb_instance *gauge, const plumb_sink *answer) {
    (void)gauge;
    answer->write(answer->context, text("{\"model\": \"{name}, made up\", \"quantities\": [{\"name\": \"height\", \"unit\": \"mm\"}]}"));
    return PLUMB_OK;
}

static double height_mm(void) {
    return 12.5;
}

/* Measures now: a reading is never older than after_ns, because the arm may have moved since. PLUMB_EMPTY means nothing is there yet. */
static plumb_status read_it(plumb_instance *gauge, uint64_t after_ns, const plumb_sink *answer) {
    char words[160];
    (void)after_ns;
    uint64_t time_ns = gauge->host->now_ns(gauge->host->context);
    snprintf(words, sizeof words,
             "{\"time_ns\": %" PRIu64 ", \"quantities\": [{\"name\": \"height\", \"value\": %.6f, \"standard_uncertainty\": 0.01}]}",
             time_ns, height_mm());
    answer->write(answer->context, text(words));
    return PLUMB_OK;
}

static const plumb_sensor_functions sensor = {
    .size = sizeof(plumb_sensor_functions),
    .describe = describe,
    .read = read_it,
};

static const void *extension(plumb_bytes name) {
    static const char wanted[] = "plumb.sensor/1";
    return name.length == sizeof wanted - 1 && memcmp(name.data, wanted, name.length) == 0 ? &sensor : NULL;
}

static const char manifest[] =
#include "manifest.h"
    ;

PLUMB_PLUGIN_ENTRY({crate}) = {
    .magic = PLUMB_MAGIC,
    .contract_major = PLUMB_CONTRACT_MAJOR,
    .contract_minor = PLUMB_CONTRACT_MINOR,
    .size = sizeof(plumb_entry),
    .manifest = { (const uint8_t *)manifest, sizeof manifest - 1 },
    .create = create,
    .destroy = destroy,
    .extension = extension,
};
