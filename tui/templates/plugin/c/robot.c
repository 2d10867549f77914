/* A robot of two joints, one that turns and one that slides. It moves in its own memory: replace what touches `joints` by what talks to yours.
 * The contract is in plumb_plugin.h: threads, ownership, errors, units. */
#define _POSIX_C_SOURCE 199309L

#include "plumb_plugin.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define JOINTS 2
#define STEP_S 0.02 /* between two looks at should_stop, which the contract wants at least every 0.05 s */

static const double MAX_SPEED[JOINTS] = { 1.0, 100.0 }; /* rad/s, mm/s */

struct plumb_instance {
    const plumb_host_functions *host;
    plumb_joint_vector joints; /* rad, mm */
};

static plumb_bytes text(const char *words) {
    plumb_bytes bytes = { (const uint8_t *)words, strlen(words) };
    return bytes;
}

static plumb_status fail(plumb_instance *arm, plumb_status status, const char *why) {
    arm->host->fail(arm->host->context, text(why));
    return status;
}

/* Where it is now, by the cell's clock. */
static plumb_joint_state state_now(plumb_instance *arm, uint32_t moving) {
    plumb_joint_state state = { 0 };
    state.time_ns = arm->host->now_ns(arm->host->context);
    state.moving = moving;
    state.joints = arm->joints;
    return state;
}

static plumb_status emit_state(plumb_instance *arm, uint32_t moving) {
    plumb_joint_state state = state_now(arm, moving);
    plumb_bytes message = { (const uint8_t *)&state, sizeof state };
    return arm->host->emit(arm->host->context, text("joints"), message);
}

/* Connects. Nothing moves. config is the JSON of what the cell file gives under `config:`, or null; plumb_config.h reads
 * numbers, flags and texts from it. */
static plumb_status create(const plumb_host_functions *host, plumb_bytes config, plumb_instance **instance) {
    (void)config;
    plumb_instance *arm = calloc(1, sizeof *arm);
    if (arm == NULL) {
        host->fail(host->context, text("no memory for an arm"));
        return PLUMB_FAILED;
    }
    arm->host = host;
    arm->joints.count = JOINTS;
    *instance = arm;
    return PLUMB_OK;
}

static void destroy(plumb_instance *arm) {
    free(arm);
}

static plumb_status describe(plumb_instance *arm, const plumb_sink *answer) {
    (void)arm;
    answer->write(answer->context, text("{\"model\": \"{name}, in memory\", \"joints\": ["
        "{\"name\": \"waist\", \"unit\": \"rad\", \"lower\": -1.5707963267948966, \"upper\": 1.5707963267948966, \"resolution\": 1e-4, \"max_speed\": 1, \"home\": 0},"
        "{\"name\": \"slide\", \"unit\": \"mm\", \"lower\": 0, \"upper\": 200, \"resolution\": 0.01, \"max_speed\": 100, \"home\": 0}],"
        "\"capabilities\": {\"interruptible\": true, \"stop_time_ms\": 50}}"));
    return PLUMB_OK;
}

static plumb_status read_joints(plumb_instance *arm, plumb_joint_state *state) {
    *state = state_now(arm, 0);
    return PLUMB_OK;
}

/* Moves, and returns when it is at rest at its target. plumb has checked the limits. */
static plumb_status move_joints(plumb_instance *arm, const plumb_motion *motion, plumb_joint_state *state) {
    double from[JOINTS], way[JOINTS], seconds = 0;
    for (int joint = 0; joint < JOINTS; joint++) {
        from[joint] = arm->joints.values[joint];
        way[joint] = 0;
        if ((motion->joint_mask >> joint) & 1u) {
            way[joint] = motion->target.values[joint] - (motion->relative ? 0 : from[joint]);
        }
        seconds = fmax(seconds, fabs(way[joint]) / MAX_SPEED[joint] / motion->speed_fraction);
    }
    double steps = fmax(1, ceil(seconds / STEP_S));
    for (double step = 1; step <= steps; step++) {
        struct timespec pause = { 0, (long)(STEP_S * 1e9) };
        if (arm->host->should_stop(arm->host->context)) {
            return fail(arm, PLUMB_STOPPED, "stopped on its way"); /* command your controller to stop before that */
        }
        nanosleep(&pause, NULL);
        for (int joint = 0; joint < JOINTS; joint++) {
            arm->joints.values[joint] = from[joint] + way[joint] * (step / steps);
        }
        if (emit_state(arm, step < steps) != PLUMB_OK) {
            return fail(arm, PLUMB_FAILED, "the joints could not be emitted");
        }
    }
    *state = state_now(arm, 0);
    return PLUMB_OK;
}

/* Brings it to rest, now. */
static plumb_status stop(plumb_instance *arm) {
    (void)arm;
    return PLUMB_OK;
}

static const plumb_robot_functions robot = {
    .size = sizeof(plumb_robot_functions),
    .describe = describe,
    .read_joints = read_joints,
    .move_joints = move_joints,
    .stop = stop,
};

static const void *extension(plumb_bytes name) {
    static const char wanted[] = "plumb.robot/1";
    return name.length == sizeof wanted - 1 && memcmp(name.data, wanted, name.length) == 0 ? &robot : NULL;
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
