/* counting_arm.c - a whole plugin in C: an arm of two joints that moves in its own memory.
 *
 *     cc -shared -fPIC -I ../../include -o libcounting_arm.so counting_arm.c -lm
 *
 * It moves in steps of 10 ms at up to 1 rad/s, looks at should_stop before each, and has one input line that is high while the first joint
 * is above 0.5 rad.
 */
#define _POSIX_C_SOURCE 199309L

#include "plumb_plugin.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define JOINTS 2
#define STEP_S 0.01
#define MAX_SPEED_RAD_S 1.0
#define LINE_THRESHOLD_RAD 0.5

struct plumb_instance {
    const plumb_host_functions *host;
    plumb_joint_vector joints;
    uint64_t levels;
};

static plumb_bytes text(const char *words) {
    plumb_bytes bytes = { (const uint8_t *)words, strlen(words) };
    return bytes;
}

static plumb_status refuse(plumb_instance *arm, plumb_status status, const char *why) {
    arm->host->fail(arm->host->context, text(why));
    return status;
}

static void wait_one_step(void) {
    struct timespec step = { 0, (long)(STEP_S * 1e9) };
    nanosleep(&step, NULL);
}

static plumb_joint_state state_now(plumb_instance *arm, uint32_t moving) {
    plumb_joint_state state = { 0 };
    state.time_ns = arm->host->now_ns(arm->host->context);
    state.moving = moving;
    state.joints = arm->joints;
    return state;
}

static plumb_digital_inputs inputs_now(plumb_instance *arm, uint64_t changed) {
    plumb_digital_inputs inputs = { 0 };
    inputs.time_ns = arm->host->now_ns(arm->host->context);
    inputs.levels = arm->levels;
    inputs.changed = changed;
    inputs.joints = arm->joints;
    inputs.joints_half_width.count = JOINTS;
    inputs.joints_half_width.values[0] = MAX_SPEED_RAD_S * STEP_S;
    inputs.joints_half_width.values[1] = MAX_SPEED_RAD_S * STEP_S;
    return inputs;
}

static plumb_status emit_state(plumb_instance *arm, uint32_t moving) {
    plumb_joint_state state = state_now(arm, moving);
    plumb_bytes message = { (const uint8_t *)&state, sizeof state };
    return arm->host->emit(arm->host->context, text("joints"), message);
}

static plumb_status emit_inputs(plumb_instance *arm, uint64_t changed) {
    plumb_digital_inputs inputs = inputs_now(arm, changed);
    plumb_bytes message = { (const uint8_t *)&inputs, sizeof inputs };
    return arm->host->emit(arm->host->context, text("inputs"), message);
}

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
    host->log(host->context, PLUMB_LOG_INFO, text("the counting arm stands at zero"));
    return PLUMB_OK;
}

static void destroy(plumb_instance *arm) {
    free(arm);
}

static plumb_status describe(plumb_instance *arm, const plumb_sink *answer) {
    (void)arm;
    answer->write(answer->context, text("{\"model\": \"counting arm\", \"joints\": ["));
    answer->write(answer->context, text("{\"name\": \"waist\", \"unit\": \"rad\", \"lower\": -1.5, \"upper\": 1.5, "
                                        "\"resolution\": 0, \"max_speed\": 1.0, \"home\": 0},"));
    answer->write(answer->context, text("{\"name\": \"shoulder\", \"unit\": \"rad\", \"lower\": -0.5, \"upper\": 2.0, "
                                        "\"resolution\": 0, \"max_speed\": 1.0, \"home\": 0}"));
    answer->write(answer->context, text("], \"inputs\": [{\"name\": \"line 0\", \"bit\": 0}], "
                                        "\"capabilities\": {\"interruptible\": true, \"stop_time_ms\": 20}}"));
    return PLUMB_OK;
}

static plumb_status read_joints(plumb_instance *arm, plumb_joint_state *state) {
    *state = state_now(arm, 0);
    return PLUMB_OK;
}

/* Reports where the arm is, and its line when that changed. */
static plumb_status report_step(plumb_instance *arm, uint32_t moving) {
    uint64_t levels = arm->joints.values[0] > LINE_THRESHOLD_RAD ? 1u : 0u;
    uint64_t changed = levels ^ arm->levels;
    arm->levels = levels;
    if (changed != 0 && emit_inputs(arm, changed) != PLUMB_OK) {
        return refuse(arm, PLUMB_FAILED, "the counting arm could not report its line");
    }
    if (emit_state(arm, moving) != PLUMB_OK) {
        return refuse(arm, PLUMB_FAILED, "the counting arm could not report its joints");
    }
    return PLUMB_OK;
}

static plumb_status move_joints(plumb_instance *arm, const plumb_motion *motion, plumb_joint_state *state) {
    double from[JOINTS], way[JOINTS], longest = 0;
    for (int joint = 0; joint < JOINTS; joint++) {
        from[joint] = arm->joints.values[joint];
        way[joint] = motion->target.values[joint] - (motion->relative ? 0 : from[joint]);
        if (!((motion->joint_mask >> joint) & 1u)) {
            way[joint] = 0;
        }
        longest = fmax(longest, fabs(way[joint]));
    }

    double steps = fmax(1, ceil(longest / (MAX_SPEED_RAD_S * STEP_S * motion->speed_fraction)));
    for (double step = 1; step <= steps; step++) {
        if (arm->host->should_stop(arm->host->context)) {
            emit_inputs(arm, 0);
            return refuse(arm, PLUMB_STOPPED, "the counting arm was stopped on its way");
        }
        wait_one_step();
        for (int joint = 0; joint < JOINTS; joint++) {
            arm->joints.values[joint] = step < steps ? from[joint] + way[joint] * step / steps : from[joint] + way[joint];
        }
        plumb_status status = report_step(arm, step < steps);
        if (status != PLUMB_OK) {
            return status;
        }
    }
    *state = state_now(arm, 0);
    return emit_inputs(arm, 0); /* after the state was taken: who has seen this has seen the whole move */
}

static plumb_status stop(plumb_instance *arm) {
    (void)arm; /* it is at rest whenever it is not in move_joints */
    return PLUMB_OK;
}

static plumb_status read_inputs(plumb_instance *arm, plumb_digital_inputs *inputs) {
    *inputs = inputs_now(arm, 0);
    return PLUMB_OK;
}

static const plumb_robot_functions robot = {
    .size = sizeof(plumb_robot_functions),
    .describe = describe,
    .read_joints = read_joints,
    .move_joints = move_joints,
    .stop = stop,
    .read_inputs = read_inputs,
};

static const void *extension(plumb_bytes name) {
    static const char robot_name[] = "plumb.robot/1";
    if (name.length == sizeof robot_name - 1 && memcmp(name.data, robot_name, name.length) == 0) {
        return &robot;
    }
    return NULL;
}

static const char manifest[] =
    "id: counting-arm\n"
    "title: An arm in C that moves in its own memory, to show the contract\n"
    "version: 1.0.0\n"
    "contract: [1, 0]\n"
    "kind: robot\n"
    "library: libcounting_arm.so\n"
    "streams:\n"
    "  - {name: joints, message: joint-state/1}\n"
    "  - {name: inputs, message: digital-inputs/1}\n"
    "config:\n"
    "  type: object\n"
    "  additionalProperties: false\n"
    "  properties: {}\n";

PLUMB_PLUGIN_ENTRY(counting_arm) = {
    .magic = PLUMB_MAGIC,
    .contract_major = PLUMB_CONTRACT_MAJOR,
    .contract_minor = PLUMB_CONTRACT_MINOR,
    .size = sizeof(plumb_entry),
    .manifest = { (const uint8_t *)manifest, sizeof manifest - 1 },
    .create = create,
    .destroy = destroy,
    .extension = extension,
};
